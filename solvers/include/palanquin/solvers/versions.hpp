#pragma once

#include <map>
#include <string>

namespace palanquin {

/// Versions of the libraries that the engine was compiled with or is linked to, by name.
std::map<std::string, std::string> library_versions();

}  // namespace palanquin
