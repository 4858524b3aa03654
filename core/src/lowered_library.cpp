#include "palanquin/core/lowered_library.hpp"

#include <dlfcn.h>
#include <elf.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace palanquin {

namespace {

/// Whether a library's file ends before what its headers say is to be loaded. The loader does not
/// look: the first access to what is missing would kill the process. What is no library at all,
/// the loader refuses.
bool is_cut_off(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Elf64_Ehdr header{};
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return false;
  if (std::string_view(reinterpret_cast<const char*>(header.e_ident), SELFMAG) != ELFMAG ||
      header.e_phentsize != sizeof(Elf64_Phdr))
    return false;
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  file.seekg(static_cast<std::streamoff>(header.e_phoff));
  file.read(reinterpret_cast<char*>(segments.data()),
            static_cast<std::streamsize>(segments.size() * sizeof(Elf64_Phdr)));
  if (!file) return true;
  const auto size = std::filesystem::file_size(path);
  return std::any_of(segments.begin(), segments.end(), [size](const Elf64_Phdr& segment) {
    return segment.p_type == PT_LOAD && segment.p_offset + segment.p_filesz > size;
  });
}

}  // namespace

LoweredLibrary::LoweredLibrary(const std::string& path) : path_(path) {
  if (is_cut_off(path)) throw std::runtime_error("cannot load '" + path + "': the file is cut off");
  // The loader looks for a bare file name in the system's folders.
  void* handle = dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    const char* reason = dlerror();
    throw std::runtime_error("cannot load '" + path + "': " + (reason ? reason : "unknown"));
  }
  handle_ = std::shared_ptr<void>(handle, [](void* h) { dlclose(h); });
  const auto missing =
      reinterpret_cast<const char* (*)()>(symbol("palanquin_missing_instructions"))();
  if (missing != nullptr)
    throw std::runtime_error("'" + path + "' was compiled for processors with " + missing +
                             ", which this one lacks: compile it here");
}

void* LoweredLibrary::symbol(const std::string& symbol) const {
  void* address = find_symbol(symbol);
  if (address == nullptr)
    throw std::runtime_error("'" + path_ + "' has no symbol '" + symbol +
                             "'; it was not lowered by this version of Palanquin");
  return address;
}

void* LoweredLibrary::find_symbol(const std::string& symbol) const {
  return dlsym(handle_.get(), symbol.c_str());
}

std::string LoweredLibrary::manifest() const {
  return reinterpret_cast<const char* (*)()>(symbol("palanquin_manifest"))();
}

void LoweredLibrary::check_structure(const Manifest& manifest) const {
  if (parse_manifest(this->manifest(), path_).structure != manifest.structure)
    throw std::runtime_error("'" + path_ + "' was lowered from another problem than this '" +
                             manifest.name + "'");
}

}  // namespace palanquin
