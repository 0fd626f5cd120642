// Steps the cases of export_motions, on Linux or on Windows:  step_motions CASES OUT [--results FOLDER] NAME…
// Writes to OUT/NAME.ticks, for each tick, the chained hash and 13 numbers: position, rotation and wrench. Writes to
// OUT/NAME.calls every call of a function of the system's mathematical library: function, tick, two arguments, result.
// Tick -1 is the making of the world. With --results these calls get the results that another system wrote to FOLDER.
// Prints the hash of each world, that of all ticks, and how many calls differed from the other system's.
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/tree_file.hpp"
#include "haptics/loop/step.hpp"
#include "tests/builds/motion_case.hpp"

namespace {

struct Call {
    std::int32_t function, tick;
    double x, y, result;
};
std::vector<Call> calls, others;
std::size_t unlike = 0;  // calls that another system did not make with these arguments
std::int32_t tickNow = -1;

double noted(int function, double x, double y, double result) {
    Call call{function, tickNow, x, y, result};
    if (!others.empty()) {
        const Call other = calls.size() < others.size() ? others[calls.size()] : Call{};
        const bool same = other.function == function && other.tick == tickNow &&
                          std::memcmp(&other.x, &x, sizeof x) == 0 && std::memcmp(&other.y, &y, sizeof y) == 0;
        if (same)
            call.result = other.result;
        else
            ++unlike;
    }
    calls.push_back(call);
    return call.result;
}

}  // namespace

// The linker gives calls of NAME to __wrap_NAME, and calls of __real_NAME to NAME.
#pragma GCC diagnostic ignored "-Wpedantic"
extern "C" {
double __real_sin(double);
double __real_cos(double);
double __real_atan2(double, double);
double __real_asin(double);
double __real_acos(double);
double __real_hypot(double, double);
double __real_pow(double, double);
double __real_fmod(double, double);
double __wrap_sin(double x) { return noted(0, x, 0, __real_sin(x)); }
double __wrap_cos(double x) { return noted(1, x, 0, __real_cos(x)); }
double __wrap_atan2(double y, double x) { return noted(2, y, x, __real_atan2(y, x)); }
double __wrap_asin(double x) { return noted(3, x, 0, __real_asin(x)); }
double __wrap_acos(double x) { return noted(4, x, 0, __real_acos(x)); }
double __wrap_hypot(double x, double y) { return noted(5, x, y, __real_hypot(x, y)); }
double __wrap_pow(double x, double y) { return noted(6, x, y, __real_pow(x, y)); }
double __wrap_fmod(double x, double y) { return noted(7, x, y, __real_fmod(x, y)); }
void __real_sincos(double, double*, double*);  // the compiler makes one call of both
void __wrap_sincos(double x, double* sine, double* cosine) {
    __real_sincos(x, sine, cosine);
    *sine = noted(0, x, 0, *sine);
    *cosine = noted(1, x, 0, *cosine);
}
}

namespace {

namespace fs = std::filesystem;
using namespace touchstone;
using namespace touchstone::builds;

World worldOf(const MotionCase& all, const fs::path& folder) {
    World world;
    for (std::size_t i = 0; i < all.parts.size(); ++i) {
        const MotionPart& part = all.parts[i];
        std::shared_ptr<const Surface> surface;
        if (part.byMesh) surface = std::make_shared<const Surface>(surfaceFeatures(repairMesh(part.mesh)));
        std::shared_ptr<const SphereTree> tree;
        if (part.bySpheres)
            tree = std::make_shared<const SphereTree>(loadTree(folder / (std::to_string(i) + ".spheres")));
        Part made{surface, tree, part.prefersSpheres, {}};
        if (part.rubs) made.material = part.material;
        if (i > 0) {
            world.obstacles.push_back({"obstacle", std::move(made), part.X_WO});
            continue;
        }
        world.tool = std::move(made);
        world.X_WT_start = part.X_WO;
    }
    return world;
}

std::vector<Call> readCalls(const fs::path& file) {
    std::vector<Call> read(fs::file_size(file) / sizeof(Call));
    std::ifstream(file, std::ios::binary)
        .read(reinterpret_cast<char*>(read.data()), std::streamsize(read.size() * sizeof(Call)));
    return read;
}

void stepCase(const fs::path& cases, const fs::path& out, const fs::path& results, const std::string& name) {
    const MotionCase all = readCase(cases / name / "case");
    calls.clear();
    others = results.empty() ? std::vector<Call>() : readCalls(results / (name + ".calls"));
    unlike = 0;
    tickNow = -1;
    const World world = worldOf(all, cases / name);
    const Settings settings = settingsOf(all);
    std::ofstream ticks(out / (name + ".ticks"), std::ios::binary);
    TickState state(world);
    state.reset(all.device.at(0));  // as the program does
    std::uint64_t hash = 0;
    for (std::size_t i = 0; i < all.device.size(); ++i) {
        tickNow = std::int32_t(i);
        const TickRecord r = step(world, settings, {all.device[i]}, state, {.audit = true});
        hash = i == 0 ? hashTick(r) : hashTick(r, hash);
        double row[13];
        std::copy_n(r.X_WT.p.data(), 3, row);
        std::copy_n(r.X_WT.q.coeffs().data(), 4, row + 3);
        std::copy_n(r.wrench_C.force.data(), 3, row + 7);
        std::copy_n(r.wrench_C.torque.data(), 3, row + 10);
        ticks.write(reinterpret_cast<const char*>(&hash), sizeof hash);
        ticks.write(reinterpret_cast<const char*>(row), sizeof row);
    }
    std::ofstream(out / (name + ".calls"), std::ios::binary)
        .write(reinterpret_cast<const char*>(calls.data()), std::streamsize(calls.size() * sizeof(Call)));
    std::printf("%s %016llx %016llx", name.c_str(), static_cast<unsigned long long>(worldHash(world)),
                static_cast<unsigned long long>(hash));
    std::printf(results.empty() ? "\n" : " %zu\n", unlike);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const bool given = argc > 4 && std::strcmp(argv[3], "--results") == 0;
        for (int i = given ? 5 : 3; i < argc; ++i) stepCase(argv[1], argv[2], given ? argv[4] : "", argv[i]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "step_motions: %s\n", error.what());
        return 1;
    }
}
