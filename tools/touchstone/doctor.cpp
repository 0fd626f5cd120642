// touchstone doctor: what works on this machine, what does not, and what to do about it.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "engine/view/gl_context.hpp"
#include "engine/view/window.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;

struct DoctorCommand {
    std::optional<double> stiffness, rate;  ///< N/mm, Hz, of a contact that should feel passive; none: the defaults
};

constexpr double kPassive = 1.1;  // times the least damping: a simulated hand then gains no energy (hard case 14)
constexpr const char* kBunny = "/usr/share/glmark2/models/bunny.obj";

enum class State { Works, Limited, Fails };

/// Prints each finding, wrapped to the terminal, and remembers whether anything failed.
class Examination {
  public:
    void say(const char* what, State state, const std::string& text) {
        constexpr const char* kMarks[] = {"ok", "note", "FAILS"};
        constexpr std::size_t kIndent = 18;
        std::printf("%-10s %-5s  %s\n", what, kMarks[static_cast<int>(state)], wrapped(text, kIndent).c_str());
        failed_ = failed_ || state == State::Fails;
    }
    bool failed() const { return failed_; }

  private:
    bool failed_ = false;
};

std::string processorName() {
    std::ifstream cpus("/proc/cpuinfo");
    for (std::string line; std::getline(cpus, line);)
        if (line.rfind("model name", 0) == 0)
            if (const auto colon = line.find(": "); colon != std::string::npos) return line.substr(colon + 2);
    return "unknown processor";
}

void examineProcessor(Examination& examination) {
    const unsigned cores = std::thread::hardware_concurrency();
    examination.say("processor", State::Works, processorName());
    if (cores >= 2)
        examination.say("cores", State::Works, std::to_string(cores) + ": one for the loop, the others for the window");
    else
        examination.say("cores", State::Limited,
                        "only one: loop and window share it, so expect late ticks in a window");
#if defined(__AVX512F__)
    const char* built = "AVX-512";
#elif defined(__AVX2__)
    const char* built = "AVX2";
#else
    const char* built = nullptr;
#endif
    if (built)
        examination.say("SIMD", State::Works, std::string("built for ") + built);
    else
        examination.say(
            "SIMD", State::Limited,
            "built without AVX2, so collision is slow: configure with -DTOUCHSTONE_ARCH=native or x86-64-v3");
}

void examineScheduling(Examination& examination) {
    RealTimeStatus status;
    std::thread([&] { status = raiseThread({}); }).join();
    if (status.scheduled && status.locked)
        examination.say("scheduling", State::Works, "SCHED_FIFO and locked memory are allowed");
    else
        examination.say("scheduling", State::Limited, status.message);
    if (const std::string words = throttlingWords(status); !words.empty())
        examination.say("throttling", State::Limited, words);
}

void examineGraphics(Examination& examination) {
    try {
        const engine::HeadlessContext context;
        examination.say("pictures", State::Works, engine::glDescription());
    } catch (const std::exception& error) {
        examination.say("pictures", State::Fails, error.what());
    }
    const char* display = std::getenv("DISPLAY");
    const char* wayland = std::getenv("WAYLAND_DISPLAY");
    if (!(display && *display) && !(wayland && *wayland)) {
        examination.say("window", State::Limited,
                        "no display: run with --headless, or on a desktop, over 'ssh -X' or under 'xvfb-run'");
        return;
    }
    try {
        const engine::Window window({.visible = false});
        examination.say("window", State::Works, engine::glDescription());
    } catch (const std::exception& error) {
        examination.say("window", State::Fails, error.what());
    }
}

void examineDevices(Examination& examination) {
    for (const DeviceInfo& device : sandbox::allDevices()) {
        const DeviceCheck check = device.examine ? device.examine() : DeviceCheck{};
        examination.say("device", check.works ? State::Works : State::Limited,
                        std::string(device.name) + ": " + std::string(device.summary) +
                            (check.text.empty() ? "" : ". " + check.text));
    }
}

void explainPassivity(Examination& examination, const DoctorCommand& command) {
    const double k = command.stiffness.value_or(Settings{}.stiffness), rate = command.rate.value_or(Settings{}.rate);
    const auto least = [&](double delay) { return kPassive * leastDamping(k, rate, delay); };
    char text[400];
    std::snprintf(
        text, sizeof text,
        "k = %g N/mm sampled every T = %g ms feeds no energy to the hand if device and hand provide a damping of at "
        "least 1.1 k T (0.5 + d): %.3g N·s/m without delay, %.3g with d = 1 tick, the delay of a driver with "
        "its own thread (--stiffness, --rate)",
        k, 1000 / rate, least(0), least(1));
    examination.say("passivity", State::Works, text);
}

void examineData(Examination& examination) {
    if (std::error_code error; fs::is_regular_file(kBunny, error))
        examination.say("bunny", State::Works, kBunny);
    else
        examination.say("bunny", State::Limited,
                        std::string(kBunny) + " is missing; scenes are made from it: apt install glmark2-data");
    std::string names;
    for (const fs::path& scene : listScenes()) names += (names.empty() ? "" : ", ") + scene.stem().string();
    if (names.empty())
        examination.say("scenes", State::Fails,
                        "none in " + sceneFolder().string() + ": build the target 'scenes' (cmake --build makes all)");
    else
        examination.say("scenes", State::Works, names);

    const fs::path cache = sandbox::treeCacheFolder();
    std::error_code error;
    if (!cache.empty()) fs::create_directories(cache, error);
    if (!cache.empty() && access(cache.c_str(), W_OK) == 0)
        examination.say("cache", State::Works, "sphere trees are stored in " + cache.string());
    else
        examination.say(
            "cache", State::Limited,
            (cache.empty() ? std::string("no folder for sphere trees") : cache.string() + " is not writable") +
                ", so they are built again each time: set TOUCHSTONE_CACHE to a writable folder");
}

int doctor(const DoctorCommand& command) {
    Examination examination;
    examineProcessor(examination);
    examineScheduling(examination);
    examineGraphics(examination);
    examineDevices(examination);
    explainPassivity(examination, command);
    examineData(examination);
    return examination.failed() ? kFailed : kOk;
}

constexpr const char* kDoctorFooter =
    "Examples:\n"
    "  touchstone doctor\n"
    "  touchstone doctor --stiffness 2 --rate 4000\n";

}  // namespace

void addDoctor(CLI::App& program, Action& action) {
    const auto options = std::make_shared<DoctorCommand>();
    CLI::App* command = addCommand(
        program, "doctor", "Report what works on this machine, what does not, and what to do about it", kDoctorFooter);
    command->add_option("--stiffness", options->stiffness, "stiffness of the contact that should feel passive, N/mm")
        ->check(within(1e-3, 1e6, "N/mm"));
    command->add_option("--rate", options->rate, "tick rate of that contact, Hz")->check(within(1, 1e6, "Hz"));
    command->callback([options, &action] { action = [options] { return doctor(*options); }; });
}

}  // namespace touchstone::app
