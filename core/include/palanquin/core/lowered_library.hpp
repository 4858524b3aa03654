#pragma once

#include <memory>
#include <string>

#include "palanquin/core/manifest.hpp"

namespace palanquin {

/// A shared library of lowered functions, closed when its last user is gone.
class LoweredLibrary {
 public:
  /// Throws std::runtime_error when `path` cannot be loaded (with the loader's reason), was not
  /// lowered by this version, or uses instructions that this processor lacks.
  explicit LoweredLibrary(const std::string& path);
  /// Address of `symbol`; throws std::runtime_error when the library lacks it.
  void* symbol(const std::string& symbol) const;
  /// Address of `symbol`, null when the library lacks it.
  void* find_symbol(const std::string& symbol) const;
  const std::string& path() const { return path_; }

  /// The manifest that the library was compiled with, as text.
  std::string manifest() const;
  /// Throws std::runtime_error unless the library was made of the problem of `manifest`.
  void check_structure(const Manifest& manifest) const;

 private:
  std::string path_;
  std::shared_ptr<void> handle_;
};

}  // namespace palanquin
