#include "haptics/sandbox/devices/inverse_link.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

constexpr std::uint64_t kNsPerMs = 1'000'000;
constexpr auto kOpeningTime = std::chrono::seconds(2);  // the service is on this machine, and replies within ms
// Time without a reply after which that is a fault: the hand's position is then unknown, as in the safety stage.
constexpr std::uint64_t kSilenceNs = 100 * kNsPerMs;
constexpr double kNominalStiffness = 1;  // N/mm; not confirmed

bool takePort(const std::string& text, int& to) {
    double port = 0;
    if (!takeNumber(text, 1, 65535, port) || port != std::floor(port)) return false;
    to = static_cast<int>(port);
    return true;
}

void sleepUntil(std::uint64_t ns) {
    const timespec when{.tv_sec = static_cast<std::time_t>(ns / 1'000'000'000),
                        .tv_nsec = static_cast<long>(ns % 1'000'000'000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr);
}

}  // namespace

InverseOptions inverseOptions(const std::string& text) {
    InverseOptions options;
    if (const char* port = std::getenv("TOUCHSTONE_INVERSE"); port && *port && !takePort(port, options.port))
        throw std::runtime_error("inverse3: TOUCHSTONE_INVERSE is '" + std::string(port) +
                                 "', which is no port: set it to a number from 1 to 65535");
    const auto word = [](const std::string& value, std::string& to) {
        to = value;
        return !value.empty();
    };
    readArmOptions("inverse3", text,
                   "inverse3[:port=PORT][,events=PORT][,device=ID][,grip=ID][,force=vector or values]"
                   "[,rate=250 to 4000][,stale=1 to 1000 ms][,peak=0.1 to 20 N][,continuous=0.1 to 20 N]",
                   [&](const std::string& key, const std::string& value) {
                       return key == "port"     ? takePort(value, options.port)
                              : key == "events" ? takePort(value, options.eventsPort)
                              : key == "device" ? word(value, options.device)
                              : key == "grip"   ? word(value, options.grip)
                              : key == "force"
                                  ? word(value, options.command) && (value == "vector" || value == "values")
                              : key == "rate"       ? takeNumber(value, 250, 4000, options.rate)
                              : key == "stale"      ? takeNumber(value, 1, 1000, options.staleMs)
                              : key == "peak"       ? takeNumber(value, 0.1, 20, options.peakForce)
                              : key == "continuous" ? takeNumber(value, 0.1, 20, options.continuousForce)
                                                    : false;
                   });
    return options;
}

std::shared_ptr<InverseLink> InverseLink::connect(const std::string& text) {
    return sharedLink<InverseLink>(text, [&] { return std::make_shared<InverseLink>(inverseOptions(text)); });
}

DeviceCheck InverseLink::examine() {
    try {
        return {true, InverseLink(inverseOptions({})).status().text};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

InverseLink::InverseLink(InverseOptions options) : ArmLink(options.staleMs), options_(std::move(options)) {
    limits_ = {.peakForce = options_.peakForce,
               .continuousForce = std::min(options_.continuousForce, options_.peakForce),
               .torque = false,
               .nominalStiffness = kNominalStiffness};
    openOrClose();
}

InverseLink::~InverseLink() {
    endReconnecting();
    close();
}

// -- Opening and closing -------------------------------------------------------------------------------------------

void InverseLink::open() {
    sockets_ = std::make_unique<WebSockets>(*this);
    inventory_ = {};
    state_ = {};
    q_DS_ = Quat::Identity();
    gripId_ = options_.grip;
    nextSend_ = lastSend_ = lastReceived_ = 0;
    running_ = hasGrip_ = false;
    events_ = Events::Connecting;
    enter(Phase::Connecting);
    begin();
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });

    std::unique_lock lock(phaseMutex_);
    phaseChanged_.wait_for(lock, kOpeningTime, [&] { return phase_ == Phase::Running || phase_ == Phase::Failed; });
    if (phase_ == Phase::Running) return;
    const std::string port = std::to_string(options_.port);
    const std::string why = phase_ == Phase::Failed    ? problem_
                            : phase_ == Phase::Waiting ? "it sends no state"
                                                       : "it sends no inventory";
    throw std::runtime_error("Inverse3: no device at port " + port + " of this machine: " + why);
}

void InverseLink::close() noexcept {
    if (thread_.joinable()) {
        if (!lost()) settle();
        zeroFrameSize_ = 0;
        thread_ = {};
    }
    sockets_.reset();
    markLost();
}

void InverseLink::enter(Phase phase, const std::string& problem) {
    {
        const std::lock_guard lock(phaseMutex_);
        if (phase_ == Phase::Failed && phase != Phase::Connecting) return;
        phase_ = phase;
        problem_ = problem;
    }
    phaseChanged_.notify_all();
}

// -- The window's thread -------------------------------------------------------------------------------------------

std::string InverseLink::faultText(std::uint32_t code) const {
    if (code == kTooSlow) return "The service exchanges fewer than 250 messages a second: close other programs";
    switch (static_cast<InverseFault>(code)) {
        case InverseFault::NotJson:
            return "The service has sent a message that is no JSON";
        case InverseFault::NoPosition:
            return "A state of the service lacks the position, or it is no finite number";
        case InverseFault::FarPosition:
            return "A state of the service has a position beyond 1 km";
        case InverseFault::NotReady:
            return "The Inverse3 lost its power supply, its calibration or its readiness: power and calibrate it";
        case InverseFault::GripLost:
            return "The VerseGrip is gone or asleep: wake it, or engage to go on with a fixed orientation";
        case InverseFault::GripAppeared:
            return "A VerseGrip has appeared: engage to use its orientation";
        case InverseFault::Silent:
            return "The service does not reply";
        case InverseFault::SafetyEvent: {
            const std::lock_guard lock(phaseMutex_);
            return note_;
        }
        case InverseFault::EventsLost:
            return "The service ended its channel of events: engage to go on without its safety events";
        case InverseFault::Disconnected:
            return "The service ended the connection: see whether it runs, then reconnect";
        case InverseFault::MessageTooLong:
            return "The service has sent a message of more than 1 MiB";
        case InverseFault::Unplugged:
            return "The Inverse3 is no longer connected to the service: check cable and power";
        case InverseFault::None:
            break;
    }
    return "No fault";
}

DeviceStatus InverseLink::status() const {
    DeviceStatus status = ArmLink::status();
    if (status.state == DeviceStatus::State::Connecting || lost()) return status;
    const bool grip = hasGrip_;
    if (status.state == DeviceStatus::State::Running && !grip)
        status.text += "; without a VerseGrip the orientation stays fixed";
    status.details += grip ? "\nA VerseGrip gives the orientation" : "\nNo VerseGrip: the orientation stays fixed";
    const Events events = events_;
    if (events != Events::Open)
        status.details += "\nNo channel of events at port " + std::to_string(options_.eventsPort) +
                          ": safety events of the service are not seen";
    return status;
}

std::string InverseLink::described() const {
    char numbers[160];
    std::snprintf(numbers, sizeof numbers, "Force only, no torque\nPeak force %g N, continuous force %g N",
                  limits_.peakForce, limits_.continuousForce);
    return "Inverse Service at port " + std::to_string(options_.port) + ", forces as '" +
           (inventory_.vectorCommand ? "vector" : "values") + "'\nModel " +
           (inventory_.model.empty() ? "unknown" : inventory_.model) + ", " +
           (inventory_.handedness.empty() ? "unknown handedness" : inventory_.handedness + "-handed") + ", firmware " +
           (inventory_.firmware.empty() ? "unknown" : inventory_.firmware) +
           (inventory_.inUse ? "\nAnother program also uses the device; forces of both are added" : "") + "\n" +
           numbers;
}

// -- The thread ----------------------------------------------------------------------------------------------------

void InverseLink::run(const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "inverse3");
    // Signals that end the process interrupt another thread, so that this one can still send the zero force.
    sigset_t all;
    sigfillset(&all);
    for (const int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigdelset(&all, own);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    sockets_->connect(kSimulation, options_.port);
    sockets_->connect(kEvents, options_.eventsPort);
    while (!stop.stop_requested()) {
        sockets_->serve();
        if (running_) watchSilence();
    }
}

void InverseLink::opened(int channel) {
    if (channel == kEvents) events_ = Events::Open;
}

void InverseLink::received(int channel, const std::string& message) {
    if (channel == kEvents)
        takeEvent(message);
    else if (inventory_.device.empty())
        takeInventory(message);
    else if (!lost())
        takeState(message);
}

void InverseLink::closed(int channel, const std::string& why) {
    if (channel == kEvents) {
        const bool was = events_.exchange(Events::Refused) == Events::Open;
        if (was && running_) trip(InverseFault::EventsLost);
        return;
    }
    zeroFrameSize_ = 0;
    if (running_)
        trip(why == WebSockets::kTooLong ? InverseFault::MessageTooLong : InverseFault::Disconnected);
    else
        enter(Phase::Failed, inventory_.device.empty()
                                 ? "nothing answers there (" + why +
                                       "). Install and start Haply's Inverse Service (sudo "
                                       "systemctl start haply-inverse-service), or name its port with port=PORT"
                                 : why);
}

void InverseLink::takeInventory(const std::string& message) {
    try {
        inventory_ = readInventory(message, options_.device, gripId_);
    } catch (const std::exception& e) {
        return enter(Phase::Failed, e.what());
    }
    if (!options_.command.empty()) inventory_.vectorCommand = options_.command == "vector";
    force_ = ForceMessage(inventory_.device, inventory_.vectorCommand);
    if (const auto& grip = inventory_.state.grip) {
        hasGrip_ = true;
        gripId_ = grip->id;
    }
    prepareZeroFrame();
    enter(Phase::Waiting);
    sendNow(Vec3::Zero());
}

void InverseLink::takeState(const std::string& message) {
    const std::uint64_t now = lastReceived_ = steadyNanoseconds();
    const InverseFault fault = readState(message, inventory_.device, gripId_, state_);
    if (fault == InverseFault::None) {
        if (const auto& grip = state_.grip) {
            q_DS_ = grip->q_DS;
            gripId_ = grip->id;
        }
        if (state_.grip.has_value() != hasGrip_) {
            hasGrip_ = state_.grip.has_value();
            trip(hasGrip_ ? InverseFault::GripAppeared : InverseFault::GripLost);
        }
        publish({state_.p_DS, q_DS_}, state_.grip ? state_.grip->buttons : 0, now);
    } else {
        trip(fault);
    }
    noteExchange(now);
    if (!running_) {
        if (fault != InverseFault::None) return enter(Phase::Failed, faultText(static_cast<std::uint32_t>(fault)));
        describe("Inverse3 " + inventory_.device + " runs, with force only", described());
        running_ = true;
        enter(Phase::Running);
    }
    if (!lost()) sendForce();
}

void InverseLink::takeEvent(const std::string& message) {
    const auto event = readEvent(message, inventory_.device);
    if (!event || event->fault == InverseFault::None || !running_) return;
    {
        const std::lock_guard lock(phaseMutex_);
        note_ = event->text;
    }
    trip(event->fault);
}

void InverseLink::sendForce() {
    const std::uint64_t now = steadyNanoseconds(), period = static_cast<std::uint64_t>(1e9 / options_.rate);
    nextSend_ += period;
    if (nextSend_ < now || nextSend_ > now + period) nextSend_ = now;
    if (nextSend_ > now) sleepUntil(nextSend_);
    // One message is under way at a time: after a silence, the first of several replies only updates the state.
    if (!sockets_->pending(kSimulation)) sendNow(permitted().force);
}

void InverseLink::sendNow(const Vec3& force) {
    lastSend_ = steadyNanoseconds();
    sockets_->send(kSimulation, force_.text(force));
}

/// While the service does not reply, it gets a zero force each `stale` ms: the last force must not persist, and the
/// reply begins the exchange again.
void InverseLink::watchSilence() {
    const std::uint64_t now = steadyNanoseconds();
    if (lost() || now - lastReceived_ < staleNs() || now - lastSend_ < staleNs()) return;
    if (now - lastReceived_ > kSilenceNs) trip(InverseFault::Silent);
    sendNow(Vec3::Zero());
}

void InverseLink::trip(InverseFault fault) {
    if (!lost()) ArmLink::trip(static_cast<std::uint32_t>(fault), losesDevice(fault));
}

/// The WebSocket frame of a zero force: a final text frame, masked with zeros.
void InverseLink::prepareZeroFrame() {
    const std::string& text = force_.text(Vec3::Zero());
    unsigned char* at = zeroFrame_.data();
    *at++ = 0x81;
    if (text.size() < 126) {
        *at++ = static_cast<unsigned char>(0x80 | text.size());
    } else {
        *at++ = 0x80 | 126;
        *at++ = static_cast<unsigned char>(text.size() >> 8);
        *at++ = static_cast<unsigned char>(text.size() & 0xFF);
    }
    at = std::fill_n(at, 4, static_cast<unsigned char>(0));
    if (text.size() > static_cast<std::size_t>(zeroFrame_.end() - at)) return;
    at = std::copy(text.begin(), text.end(), at);
    zeroFrameSize_ = static_cast<std::size_t>(at - zeroFrame_.data());
}

// -- Any thread, and signal handlers -------------------------------------------------------------------------------

void InverseLink::disarm() noexcept {
    ArmLink::disarm();
    const std::size_t size = zeroFrameSize_;
    const int socket = size > 0 ? sockets_->socket(kSimulation) : -1;
    // The library writes frames whole, so this one lies between two of them. If the socket is full, nobody reads.
    if (socket >= 0) send(socket, zeroFrame_.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL);
}

}  // namespace touchstone::sandbox
