#include "haptics/sandbox/record/build_info.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace touchstone::sandbox {
namespace {

std::string processorName() {
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);)
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
    return "unknown";
}

}  // namespace

nlohmann::ordered_json buildInfo() {
    utsname system{};
    uname(&system);
    const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
    return {{"machine",
             {{"processor", processorName()},
              {"cores", sysconf(_SC_NPROCESSORS_ONLN)},
              {"memory_GB", pages / 1e9},
              {"system", std::string(system.sysname) + " " + system.release + " " + system.machine}}},
            {"version", TOUCHSTONE_VERSION},
            {"commit", TOUCHSTONE_COMMIT},
            {"compiler", TOUCHSTONE_COMPILER},
            {"flags", TOUCHSTONE_FLAGS}};
}

}  // namespace touchstone::sandbox
