#include "haptics/loop/haptic_loop.hpp"

#include <stdexcept>

namespace touchstone {
namespace {

/// Ticks per second over the last window.
class RateMeter {
  public:
    double tick(std::uint64_t now) {
        constexpr std::uint64_t kWindowNs = 250'000'000;
        if (ticks_ == 0) begin_ = now;
        if (now - begin_ >= kWindowNs) {
            rate_ = 1e9 * ticks_ / static_cast<double>(now - begin_);
            begin_ = now;
            ticks_ = 0;
        }
        ++ticks_;
        return rate_;
    }

  private:
    std::uint64_t begin_ = 0;
    int ticks_ = 0;
    double rate_ = 0;
};

}  // namespace

HapticLoop::HapticLoop(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
                       const LoopOptions& options)
    : options_(options),
      nanosecondsPerRowIteration_(calibrateWork()),
      ring_(options.ringCapacity),
      driver_(makeSession(std::move(world), settings, std::move(device))) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    ready_.wait();
}

HapticLoop::~HapticLoop() = default;

Settings HapticLoop::checked(const Settings& settings) const {
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) throw std::invalid_argument(wrong);
    return limitWork(settings, nanosecondsPerRowIteration_, options_.shares);
}

std::unique_ptr<Session> HapticLoop::makeSession(std::shared_ptr<const World> world, const Settings& settings,
                                                 std::unique_ptr<Device> device) const {
    auto session = std::make_unique<Session>(std::move(world), checked(settings), std::move(device));
    if (options_.helper) session->keeper = std::make_unique<ListKeeper>(*session->world);
    return session;
}

void HapticLoop::setSettings(const Settings& settings) { settings_.write({checked(settings), newestSession_}); }

void HapticLoop::open(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device) {
    auto session = makeSession(std::move(world), settings, std::move(device));
    session->number = ++newestSession_;
    incoming_.put(std::move(session));  // frees one that was never taken
    outgoing_.take();
}

bool HapticLoop::poll() {
    outgoing_.take();
    return snapshots_.update();
}

void HapticLoop::takeRequests() {
    // A session is taken only when there is room to hand the present one back.
    if (!driver_.opening() && outgoing_.empty())
        if (auto session = incoming_.take()) driver_.open(std::move(session));

    settingsWaiting_ |= settings_.update();
    if (settingsWaiting_ && settings_.get().session <= driver_.newestSession()) {
        if (settings_.get().session == driver_.newestSession()) driver_.request(settings_.get().settings);
        settingsWaiting_ = false;
    }
    if (restart_.load(std::memory_order_relaxed) && restart_.exchange(false, std::memory_order_relaxed))
        driver_.restart();
}

void HapticLoop::run(const std::stop_token& stop) {
    realTime_ = raiseThread(options_.realTime);
    const TickClocks clocks{.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds};
    ready_.count_down();

    LoopSnapshot snapshot;
    RateMeter meter;
    double rate = driver_.settings().rate;
    Pacer pacer(rate, realTime_.scheduled);
    std::uint64_t begunBefore = steadyNanoseconds();
    // Called here, or by the scheduler of the device that holds the tool; false: this thread is needed.
    const std::function<bool()> tick = [&] {
        takeRequests();
        const Device* const device = driver_.session().device.get();
        const std::uint64_t began = steadyNanoseconds();
        snapshot.record = driver_.tick(clocks);
        snapshot.record.periodUs = 1e-3 * static_cast<double>(began - begunBefore);
        snapshot.record.overruns = pacer.overruns();
        begunBefore = began;

        ring_.push(snapshot.record);
        snapshot.settings = driver_.settings();
        snapshot.session = driver_.session().number;
        ++snapshot.ticks;
        snapshot.overruns = pacer.overruns();
        snapshot.dropped = ring_.dropped();
        snapshot.rate = meter.tick(steadyNanoseconds());
        snapshot.fade = driver_.fade();
        snapshot.finished = driver_.finished();
        const SafetyStage& safety = driver_.session().safety;
        snapshot.trips = safety.counts();
        for (std::size_t i = 0; i < snapshot.tripping.size(); ++i)
            snapshot.tripping[i] = safety.active(static_cast<Trip>(i));
        snapshots_.write(snapshot);

        return !stop.stop_requested() && driver_.session().device.get() == device && driver_.settings().rate == rate;
    };
    while (!stop.stop_requested()) {
        const bool driven = driver_.session().device->drive(rate, tick);
        if (!driven) tick();
        if (auto retired = driver_.takeRetired()) outgoing_.put(std::move(retired));  // empty: see takeRequests()
        if (driver_.settings().rate != rate) pacer.setRate(rate = driver_.settings().rate);
        if (!driven) pacer.wait();
    }
}

}  // namespace touchstone
