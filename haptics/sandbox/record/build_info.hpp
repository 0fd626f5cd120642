#pragma once
// Where and by what program something was measured or recorded.
#include <nlohmann/json.hpp>

namespace touchstone::sandbox {

/// `machine` (processor, cores, memory_GB, system), `version`, `commit`, `compiler`, `flags`.
nlohmann::ordered_json buildInfo();

}  // namespace touchstone::sandbox
