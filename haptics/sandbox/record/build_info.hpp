#pragma once
// The machine and the program with which something was measured or recorded.
#include <nlohmann/json_fwd.hpp>

namespace touchstone::sandbox {

/// `machine` (processor, cores, memory_GB, system), `version`, `commit`, `compiler`, `flags`.
nlohmann::ordered_json buildInfo();

}  // namespace touchstone::sandbox
