#include "palanquin/core/lowered_library.hpp"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

namespace palanquin {

LoweredLibrary::LoweredLibrary(const std::string& path) : path_(path) {
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
