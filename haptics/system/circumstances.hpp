#pragma once
// Where and by what program something was measured or recorded.
#include <nlohmann/json.hpp>

namespace touchstone::system {

/// `machine` (processor, cores, memory_GB, system), `version`, `commit`, `compiler`, `flags`.
nlohmann::ordered_json circumstances();

}  // namespace touchstone::system
