#include "haptics/loop/haptic_loop.hpp"

#include <atomic>
#include <chrono>
#include <latch>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "haptics/loop/step.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/threads/mailbox.hpp"
#include "haptics/threads/ring.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "haptics/threads/triple_buffer.hpp"

#include "haptics/threads/tick_period.hpp"

namespace touchstone {
namespace {

/// Measures the ticks per second over the last window.
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

struct HapticLoop::Impl {
    Impl(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
         const LoopOptions& options);

    void setSettings(const Settings& settings);
    void moveObstacles(std::span<const Pose> X_WO);
    void open(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device);
    bool poll();
    bool pop(RecordedTick& tick);
    void forgetHistory() { forgetHistory_.store(true, std::memory_order_relaxed); }

    /// Requests of the view for a session. They carry its number, since sessions arrive through another channel.
    struct PendingRequests {
        Settings settings;
        std::vector<Pose> X_WO;  ///< target poses of the obstacles; empty: they stay
        std::uint64_t session = 0;
    };

    /// Poses of the obstacles when a state began; they have their own ring, since they are too large for every tick.
    struct StartPlaces {
        std::uint64_t number = 0;
        std::vector<Pose> X_WO;
    };

    Settings checked(const Settings& settings) const;
    std::unique_ptr<Session> makeSession(std::shared_ptr<const World> world, const Settings& settings,
                                         std::unique_ptr<Device> device) const;
    void run(const std::stop_token& stop);
    void watch(const std::stop_token& stop);
    void freeRetired();
    void takeRequests();
    void pushTick(const TickRecord& record);

    const LoopOptions options_;
    const double nanosecondsPerRowIteration_;
    PendingRequests newestRequests_;  // used by the view: for the newest session
    RealTimeStatus realTime_;         // written before ready_
    std::latch ready_{1};

    TripleBuffer<PendingRequests> requests_;
    bool requestsWait_ = false;  // used by the loop: the newest requests are for a session that has not arrived
    std::atomic<bool> restart_ = false, forgetHistory_ = false;
    enum class EngagementRequest : std::uint8_t { None, Stop, Engage };
    std::atomic<EngagementRequest> engagementRequest_ = EngagementRequest::None;
    Mailbox<Session> incoming_, outgoing_;
    TripleBuffer<LoopSnapshot> snapshots_;  // with room for the maximum number of obstacles
    Ring<RecordedTick> ring_;
    Ring<StartPlaces> starts_;   // of the ticks in ring_, in their order
    StartPlaces start_;          // used by the view: of the last tick taken
    StartPlaces nextStart_;      // used by the loop: the next entry of starts_
    bool startDropped_ = false;  // used by the loop: no tick since has had one
    TickDriver driver_;          // used by the loop

    std::mutex freeing_;  // protects sessions from being freed during watch(); never used by the loop
    std::atomic<Device*> engaged_ = nullptr;  // the session's device while its motors are engaged
    std::atomic<std::uint64_t> ticks_ = 0;
    std::atomic<bool> hung_ = false;   // set by the watchdog for the safety stage, cleared by the next tick
    std::atomic<bool> hangs_ = false;  // no tick has ended since the watchdog released the forces
    std::jthread watchdog_;
    std::jthread thread_;  // last member: it is joined, and watched until then, before what it uses is destroyed
};

HapticLoop::Impl::Impl(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
                       const LoopOptions& options)
    : options_(options),
      nanosecondsPerRowIteration_(calibrateWork()),
      snapshots_({.record = {}, .X_WO = std::vector<Pose>(kMaxObstacles), .settings = {}}),
      ring_(options.ringCapacity),
      starts_(16, {.number = 0, .X_WO = std::vector<Pose>(kMaxObstacles)}),
      driver_(makeSession(std::move(world), settings, std::move(device))) {
    newestRequests_.settings = driver_.settings();
    nextStart_.X_WO.reserve(kMaxObstacles);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    ready_.wait();
    if (options_.watchdogMs > 0) watchdog_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

Settings HapticLoop::Impl::checked(const Settings& settings) const {
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) throw std::invalid_argument(wrong);
    Settings fitting = settings;
    keepRoundTripsInTick(fitting, options_.shares);
    return limitWork(fitting, nanosecondsPerRowIteration_, options_.shares);
}

std::unique_ptr<Session> HapticLoop::Impl::makeSession(std::shared_ptr<const World> world, const Settings& settings,
                                                       std::unique_ptr<Device> device) const {
    auto session = std::make_unique<Session>(std::move(world), checked(settings), std::move(device));
    if (options_.listWorker) session->listWorker = std::make_unique<NeighborListWorker>(*session->world);
    return session;
}

void HapticLoop::Impl::setSettings(const Settings& settings) {
    newestRequests_.settings = checked(settings);
    requests_.write(newestRequests_);
}

void HapticLoop::Impl::moveObstacles(std::span<const Pose> X_WO) {
    newestRequests_.X_WO.assign(X_WO.begin(), X_WO.end());
    requests_.write(newestRequests_);
}

void HapticLoop::Impl::open(std::shared_ptr<const World> world, const Settings& settings,
                            std::unique_ptr<Device> device) {
    auto session = makeSession(std::move(world), settings, std::move(device));
    session->number = newestRequests_.session + 1;
    newestRequests_ = {.settings = session->settings, .X_WO = {}, .session = session->number};
    incoming_.put(std::move(session));  // frees a session that the loop never took
    freeRetired();
}

bool HapticLoop::Impl::poll() {
    freeRetired();
    return snapshots_.update();
}

bool HapticLoop::Impl::pop(RecordedTick& tick) {
    if (!ring_.pop(tick)) return false;
    // Skip starts whose tick was dropped.
    while (tick.start && start_.number < tick.starts && starts_.pop(start_)) {
    }
    return true;
}

void HapticLoop::Impl::takeRequests() {
    // A session is taken only if there is room to hand the present one back.
    if (!driver_.opening() && outgoing_.empty())
        if (auto session = incoming_.take()) driver_.open(std::move(session));

    requestsWait_ |= requests_.update();
    if (const PendingRequests& requests = requests_.get();
        requestsWait_ && requests.session <= driver_.newestSession()) {
        if (requests.session == driver_.newestSession()) {
            driver_.request(requests.settings);
            driver_.moveObstacles(requests.X_WO);
        }
        requestsWait_ = false;
    }
    if (restart_.load(std::memory_order_relaxed) && restart_.exchange(false, std::memory_order_relaxed))
        driver_.restart();
    using enum EngagementRequest;
    if (engagementRequest_.load(std::memory_order_relaxed) != None) {
        if (engagementRequest_.exchange(None, std::memory_order_relaxed) == Stop)
            driver_.stop();
        else
            driver_.engage();
    }
}

void HapticLoop::Impl::freeRetired() {
    if (outgoing_.empty()) return;
    const std::lock_guard lock(freeing_);
    outgoing_.take();
}

void HapticLoop::Impl::watch(const std::stop_token& stop) {
    const auto limit = static_cast<std::uint64_t>(1e6 * options_.watchdogMs);
    std::uint64_t seen = 0, since = steadyNanoseconds();
    while (!stop.stop_requested()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        const std::uint64_t ticks = ticks_.load(std::memory_order_acquire), now = steadyNanoseconds();
        if (ticks != seen) {
            seen = ticks;
            since = now;
            hangs_ = false;
        }
        if (hangs_ || now - since < limit) continue;
        const std::lock_guard lock(freeing_);
        Device* const device = engaged_.load();
        if (!device) continue;
        // hung_ is set before the forces are released, so that a tick that resumes in between also writes zero.
        hung_ = true;  // guard
        hangs_ = true;
        device->releaseForces();  // guard
    }
}

/// Pushes the newest tick to the ring. A tick with a start is dropped if the poses of its obstacles cannot be pushed.
/// When there is room again after a start was dropped, the next tick has another, since a recording may wait for one.
void HapticLoop::Impl::pushTick(const TickRecord& record) {
    const Session& session = driver_.session();
    RecordedTick tick = recordedTick(session.state, record, session.number);
    if (tick.start) {
        startDropped_ = true;
        const std::span<const Pose> X_WO = touchstone::obstaclesAtStart(session.state);
        ++nextStart_.number;
        nextStart_.X_WO.assign(X_WO.begin(), X_WO.end());
        if (!starts_.push(nextStart_)) return;
    }
    tick.starts = nextStart_.number;
    if (!ring_.push(tick)) return;
    if (startDropped_ && !tick.start) forgetHistory();
    startDropped_ = false;
}

void HapticLoop::Impl::run(const std::stop_token& stop) {
    useSignalStack();  // guard
    realTime_ = raiseThread(options_.realTime);
    TickClocks clocks{.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds, .hung = &hung_};
    ready_.count_down();

    LoopSnapshot snapshot;
    snapshot.X_WO.reserve(kMaxObstacles);
    RateMeter meter;
    double rate = driver_.settings().rate;
    Pacer pacer(rate, realTime_.scheduled);
    TickPeriod period;
    // Runs one tick; called here or by the device's scheduler. It returns false if control must return to this thread.
    const std::function<bool()> tick = [&] {
        takeRequests();
        if (snapshot.ticks > 0 && forgetHistory_.exchange(false, std::memory_order_relaxed))
            driver_.resume(snapshot.record);
        const Device* const device = driver_.session().device.get();
        clocks.periodMs = period.begin();
        snapshot.record = driver_.tick(clocks);
        snapshot.record.overruns = pacer.overruns();

        const std::span<const Pose> X_WO = driver_.session().state.obstacles();
        snapshot.X_WO.assign(X_WO.begin(), X_WO.end());
        pushTick(snapshot.record);
        snapshot.settings = driver_.settings();
        snapshot.session = driver_.session().number;
        ++snapshot.ticks;
        snapshot.overruns = pacer.overruns();
        snapshot.dropped = ring_.dropped() + starts_.dropped();
        snapshot.rate = meter.tick(steadyNanoseconds());
        snapshot.fade = driver_.fade();
        snapshot.finished = driver_.finished();
        const SafetyStage& safety = driver_.session().safety;
        // Set before a replaced session is handed back, so that the watchdog never uses a freed device.
        engaged_ = safety.motors() && isEngaged(safety.engagement()) ? driver_.session().device.get() : nullptr;
        ticks_.store(snapshot.ticks, std::memory_order_release);
        snapshot.trips = safety.counts();
        snapshot.engagement = safety.engagement();
        snapshot.cause = safety.cause();
        snapshots_.write(snapshot);

        return !stop.stop_requested() && driver_.session().device.get() == device && driver_.settings().rate == rate;
    };
    while (!stop.stop_requested()) {
        const bool driven = driver_.session().device->drive(rate, tick);
        if (!driven) tick();
        if (auto retired = driver_.takeRetired())
            outgoing_.put(std::move(retired));  // there is room, see takeRequests()
        if (driver_.settings().rate != rate) pacer.setRate(rate = driver_.settings().rate);
        if (!driven) pacer.wait();
    }
}

HapticLoop::HapticLoop(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
                       const LoopOptions& options)
    : impl_(std::make_unique<Impl>(std::move(world), settings, std::move(device), options)) {}
HapticLoop::~HapticLoop() = default;

void HapticLoop::setSettings(const Settings& settings) { impl_->setSettings(settings); }
void HapticLoop::moveObstacles(std::span<const Pose> X_WO) { impl_->moveObstacles(X_WO); }
void HapticLoop::open(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device) {
    impl_->open(std::move(world), settings, std::move(device));
}
void HapticLoop::restart() { impl_->restart_.store(true, std::memory_order_relaxed); }
void HapticLoop::stop() { impl_->engagementRequest_.store(Impl::EngagementRequest::Stop, std::memory_order_relaxed); }
void HapticLoop::engage() {
    impl_->engagementRequest_.store(Impl::EngagementRequest::Engage, std::memory_order_relaxed);
}
void HapticLoop::forgetHistory() { impl_->forgetHistory(); }
bool HapticLoop::poll() { return impl_->poll(); }
const LoopSnapshot& HapticLoop::snapshot() const { return impl_->snapshots_.get(); }
bool HapticLoop::hangs() const { return impl_->hangs_.load(std::memory_order_relaxed); }
bool HapticLoop::pop(RecordedTick& tick) { return impl_->pop(tick); }
bool HapticLoop::pop(TickRecord& record) {
    RecordedTick tick;
    const bool some = impl_->pop(tick);
    if (some) record = tick.record;
    return some;
}
std::span<const Pose> HapticLoop::obstaclesAtStart() const { return impl_->start_.X_WO; }
const RealTimeStatus& HapticLoop::realTime() const { return impl_->realTime_; }

}  // namespace touchstone
