#include "haptics/hands/inserting_hand.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace touchstone {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kLever = 45;  // mm; the length that compares rotations with translations, that of the hand's springs
constexpr double kProgress = 0.3;  // mm; the tool is stuck if it moves in by less than this within kStuckMs
constexpr double kStuckMs = 120;
constexpr double kComplyMs = 60;       // time constant with which the target follows the hand where it complies
constexpr double kPull = 0.2;          // mm; the target is this much nearer to the way than the hand
constexpr double kUpright = 2.25;      // mm on kLever; the same for a tilt: the hand holds the tool upright
constexpr double kTwistSpeed = 0.15;   // mm/ms on kLever, of aligning the tool in the air
constexpr double kMaxTwistLead = 3.6;  // mm on kLever by which the target's twist leads the hand's
constexpr double kTouch = 0.05;        // mm; a tool that is stuck this far above its goal's tolerance has arrived
constexpr double kNearWay = 1.5;       // mm; a tool that is stuck this far before the end of a segment has arrived
constexpr double kNearTurn = 7;        // mm on kLever; the same for a segment that turns
constexpr double kPastWay = 1;         // mm; a tool that is not stopped at the end of a segment goes this much further
constexpr double kSharp = 1;           // rad; bend of the way at which a tool is led to a stop
constexpr double kMaxCenter = 1;       // mm; the center of a search is this near to the way
constexpr double kStrategyMs = 3500;   // time of each kind of search
constexpr double kFirstSweep = 0.15;   // rad of the first twisting search; each next one doubles it
constexpr double kCoarse = 0.5;        // mm between the turns of the first spiral; each next one halves it
constexpr double kAttemptMs = 10500;   // time of searching after which the hand begins again
constexpr double kSticks = 0.6;  // mm that the tool is behind the search when the hand presses less, since it sticks
constexpr double kStill = 0.2, kStillMs = 40;  // mm and ms; a tool that sticks has not moved further for so long
constexpr double kFollows = 0.2;               // mm that it is behind when the hand presses as before
constexpr double kEased = 0.1;                 // of the pressing force
constexpr double kGoldenAngle = 2.4;           // rad, from one direction of tilting to the next
constexpr double kSettle = 0.5;  // mm; the spring is stretched by no more while the tool is brought to its goal
constexpr double kSettleMs = 300, kMaxSettleMs = 1500;
constexpr double kObserveMs = 1200;  // least time after the release in which the hand observes whether the tool stays
constexpr double kRestMs = 700;      // time that the tool may need to come to rest, before it must stay at the goal
constexpr double kLift = 5;          // mm above the first contact, where the hand begins again
constexpr double kRetreatMs = 4000, kDrawBackMs = 2000;
constexpr double kMissedTurns = 1.5;  // turns without progress after which a thread has not caught
constexpr double kBackTurns = 1.2;    // turns after which the beginning of a thread must have passed
constexpr double kDrop = 0.3;         // of the lead; a tool that drops by more has found the beginning

/// Random numbers that are the same on every platform, unlike the distributions of the standard library.
class Draw {
  public:
    explicit Draw(std::mt19937_64& random) : random_(random) {}
    double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
    double normal() {
        const double radius = std::sqrt(-2 * std::log(1 - uniform()));
        return radius * std::cos(kTau * uniform());
    }
    Vec3 vector(double deviation) {
        const double x = normal(), y = normal(), z = normal();
        return deviation * Vec3(x, y, z);
    }

  private:
    std::mt19937_64& random_;
};

/// The part of a rotation that is about y, rad.
double twistOf(const Quat& q) { return 2 * std::atan2(q.y(), q.w()); }

/// The least rotation that takes y to the unit vector `to`; of -y, half a turn about x. Quat::FromTwoVectors is the
/// same but takes a singular value decomposition for -y, in which GCC 12 sees uninitialized values on AVX-512.
Quat rotationFromY(const Vec3& to) {
    if (to.y() <= -1 + 1e-12) return Quat(0, 1, 0, 0);
    const double s = std::sqrt(2 * (1 + to.y()));
    return Quat(s / 2, to.z() / s, 0, -to.x() / s);
}

}  // namespace

InsertingHand::InsertingHand(const Pose& X_WT_start, const GoalRegion& goal, const InsertingParameters& parameters)
    : parameters_(parameters), goal_(goal), random_(parameters.seed), hand_(parameters.hand, X_WT_start) {
    // Choose the equivalent goal that needs the least rotation, or the start's own where the rotation does not
    // matter.
    const double whole = twistOf(goal.X_WT.q.conjugate() * X_WT_start.q);
    const bool free = goal.fold == 0 || goal.toleranceAngle > 3 || goal.lead != 0;
    if (goal.way.empty()) {
        const double turned = free ? whole : whole - goal.twist(X_WT_start);
        goal_.X_WT.q = goal.X_WT.q * expRotation({0, turned, 0});
        if (free) parameters_.twistError = 0;
    }
    segments_ = segmentsOf(goal_, goal_.X_WT.inverse() * X_WT_start);

    Draw draw(random_);
    const Vec3 aside = draw.vector(parameters.startError);
    const double twisted = parameters.startTwistError * draw.normal();
    // The error never moves the start down, toward the part.
    const Pose X_GT = goal_.X_WT.inverse() * X_WT_start;
    X_WT_start_ = goal_.X_WT *
                  Pose{X_GT.p + Vec3(aside.x(), std::abs(aside.y()), aside.z()), X_GT.q * expRotation({0, twisted, 0})};
    for (std::size_t i = 0; i < tremor_.size(); i += 2) {
        tremor_[i] = kTau * (0.008 + 0.004 * draw.uniform());
        tremor_[i + 1] = kTau * draw.uniform();
    }
    for (double* one : {&parameters_.speed, &parameters_.press, &parameters_.sweepSpeed, &parameters_.spiralSpeed,
                        &parameters_.patience})
        *one *= std::exp(0.15 * draw.normal());
    firstSweepSign_ = draw.uniform() < 0.5 ? -1 : 1;
    begin();
}

std::vector<InsertingHand::Segment> InsertingHand::segmentsOf(const GoalRegion& goal, const Pose& X_GT_start) {
    // The way ends at the goal; without one it leads straight in from the start.
    std::vector<Pose> way = goal.way;
    if (way.empty()) way.push_back({{0, std::max(1.0, X_GT_start.p.y()), 0}});
    way.push_back({});
    std::vector<Segment> segments;
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
        const Vec6 move = incrementBetween(way[i], way[i + 1]);
        const double along = move.head<3>().norm(), around = kLever * move.tail<3>().norm();
        if (along + around < 1e-6) continue;
        // A segment has its own frame at its end, with y along the motion out or about the turn.
        Segment segment;
        segment.turns = around > along;
        Vec3 out = segment.turns ? Vec3(move.tail<3>()) : Vec3(-move.head<3>());
        out.normalize();
        if (segment.turns && out.y() < 0) out = -out;
        segment.X_GS = {way[i + 1].p, rotationFromY(out)};
        segment.q_ST = segment.X_GS.q.conjugate() * way[i + 1].q;
        const Place start = placeOf(segment, way[i], Place::Zero());
        segment.length = start.norm();
        segment.in = -start / segment.length;
        segments.push_back(segment);
    }
    // A segment that ends at a sharp bend is pressed a little past its end.
    for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
        const auto direction = [](const Segment& one) {
            Vec6 d;
            d << one.X_GS.q * one.in.head<3>(), one.X_GS.q * one.in.tail<3>();
            return d;
        };
        const double cosine = direction(segments[i]).dot(direction(segments[i + 1]));
        segments[i].past = cosine < std::cos(kSharp) ? kPastWay : 0;
    }
    return segments;
}

InsertingHand::Place InsertingHand::placeOf(const Segment& segment, const Pose& X_GT, const Place& near) {
    const Pose X_ST = segment.X_GS.inverse() * X_GT;
    const Quat q = X_ST.q * segment.q_ST.conjugate();
    const Quat twist = Quat(q.w(), 0, q.y(), 0).normalized();
    Place place;
    place << X_ST.p, kLever * logRotation(q * twist.conjugate());
    place[4] = kLever * twistOf(twist);
    place[4] += kLever * kTau * std::round((near[4] - place[4]) / (kLever * kTau));
    return place;
}

Pose InsertingHand::poseOf(const Segment& segment, const Place& place) {
    const Vec3 tilt(place[3] / kLever, 0, place[5] / kLever);
    const Quat q = expRotation(tilt) * expRotation({0, place[4] / kLever, 0}) * segment.q_ST;
    return segment.X_GS * Pose{place.head<3>(), q.normalized()};
}

void InsertingHand::begin() noexcept {
    random_.seed(~parameters_.seed);
    look();
    hand_.reset(X_WT_start_);
    X_WT_seen_ = X_WT_start_;
    felt_ = {};
    searchMs_ = first_ = 0;
    attempts_ = 0;
    sweepSign_ = firstSweepSign_;
    segment_ = 0;
    target_ = placeOf(segment(), X_WB_.inverse() * X_WT_start_, Place::Zero());
    change(Act::Approach);
}

void InsertingHand::look() noexcept {
    Draw draw(random_);
    const InsertingParameters& h = parameters_;
    const Vec3 place = draw.vector(h.placeError), axis = draw.vector(h.axisError);
    const Quat turn = expRotation({axis.x(), h.twistError * draw.normal(), axis.z()});
    // What is assumed is the place where the insertion begins, whatever the depth below.
    const Vec3 mouth = goal_.depth * goal_.outAtStart();
    X_WB_ = goal_.X_WT * Pose{place + mouth - turn * mouth, turn};
    const auto seen = [&](double deviation) -> Vec3 {
        return draw.vector(deviation).cwiseMax(-deviation).cwiseMin(deviation);
    };
    const Vec3 beside = seen(h.look * goal_.tolerance), turned = seen(h.look * std::min(0.1, goal_.toleranceAngle));
    X_WV_ = goal_.X_WT * Pose{beside, expRotation(turned)};
}

void InsertingHand::change(Act act) noexcept {
    act_ = act;
    actMs_ = stuckMs_ = 0;
    eased_ = false;
    if (act == Act::Retreat) ++attempts_;
    if (act == Act::Approach || act == Act::Retreat) attemptMs_ = 0;
    if (act == Act::Approach) thread_ = Thread::None;
    least_ = INFINITY;
}

void InsertingHand::enter(std::size_t next) noexcept {
    const Pose X_GT = poseOf(segment(), target_);
    segment_ = next;
    target_ = placeOf(segment(), X_GT, Place::Zero());
    held_ = seen_ = target_;
    change(act_);
}

DeviceReading InsertingHand::read(double t, double dt) noexcept {
    if (t <= 0) {
        begin();
        return {.X_WT_device = X_WT_start_};
    }
    const Pose X_BW = X_WB_.inverse();
    held_ = placeOf(segment(), X_BW * hand_.pose(), target_);
    seen_ = placeOf(segment(), X_BW * X_WT_seen_, target_);
    actMs_ += dt;
    bool finished = false;
    switch (act_) {
        case Act::Approach:
            approach(dt);
            break;
        case Act::Press:
            press(dt);
            break;
        case Act::Settle:
            settle(dt);
            break;
        case Act::Release:
            target_ = held_ + std::exp(-dt / kComplyMs) * (target_ - held_);
            if (actMs_ > std::max(kObserveMs, kRestMs + goal_.hold)) {
                finished = isSeenAtGoal(1) || searchMs_ > parameters_.patience;
                if (!finished) change(Act::Retreat);
            }
            break;
        case Act::Retreat:
            retreat(dt);
            break;
        case Act::DrawBack:
            target_ -= parameters_.speed * dt * segments_.front().in;
            finished = actMs_ > kDrawBackMs;
            break;
    }
    return {.X_WT_device = hand_.advance(X_WB_ * poseOf(segment(), withTremor(t)), felt_, dt), .finished = finished};
}

/// How far before the end of the first segment an attempt begins, mm on kLever.
double InsertingHand::begins() const noexcept {
    return first_ == 0 ? segment().length : std::min(segment().length, first_ + kLift);
}

void InsertingHand::approach(double dt) noexcept {
    const Place rest = -begins() * segment().in - target_;
    const double mm = rest.head<3>().norm(), turn = rest.tail<3>().norm();
    const double step = parameters_.speed * dt, twist = kTwistSpeed * dt;
    target_.head<3>() += std::min(1.0, step / std::max(mm, 1e-9)) * rest.head<3>();
    target_.tail<3>() += std::min(1.0, twist / std::max(turn, 1e-9)) * rest.tail<3>();
    if (mm <= step && turn <= twist) change(Act::Press);
}

/// The target follows the hand, a little nearer to the way, in all directions but that of the segment.
void InsertingHand::comply(double dt) noexcept {
    const double keep = std::exp(-dt / kComplyMs);
    Place aside = held_ - segment().in.dot(held_) * segment().in;
    Place pull = Place::Constant(kPull);
    pull[3] = pull[5] = kUpright;
    aside -= aside.cwiseMax(-pull).cwiseMin(pull);
    const Place now = target_ - segment().in.dot(target_) * segment().in;
    target_ += aside + keep * (now - aside) - now;
}

void InsertingHand::press(double dt) noexcept {
    // Pull the target ahead of the hand, at most as far as the pressing force needs.
    const double lead = (eased_ ? kEased : 1) * parameters_.press / parameters_.hand.spring;
    const double rest = -segment().in.dot(seen_), held = -segment().in.dot(held_), target = -segment().in.dot(target_);
    target_ += (target - std::max(target - parameters_.speed * dt, held - lead)) * segment().in;
    // The tool is stuck if it has not gone on for a while.
    const double way = thread_ == Thread::None ? rest : twistLeft();  // shrinks as the tool moves on
    stuckMs_ += dt;
    if (way < least_ - kProgress) {
        least_ = way;
        stuckMs_ = 0;
    }
    const bool stuck = stuckMs_ > kStuckMs;
    // At the end of the segment: settle at the goal, or enter the next one.
    const double left = last() ? -segment().in.dot(fromGoal()) : rest;
    const bool arrived = last()
                             ? left <= 0 || (stuck && left <= goal_.tolerance + kTouch)
                             : rest <= -segment().past || (stuck && rest <= (segment().turns ? kNearTurn : kNearWay));
    if (arrived) {
        if (last())
            change(Act::Settle);
        else
            enter(segment_ + 1);
        return;
    }
    // Otherwise turn on the thread, search, or yield aside.
    if (stuck && segment_ == 0 && first_ == 0) first_ = rest;
    eased_ = eased_ && stuck;
    if (thread_ != Thread::None || (stuck && goal_.lead != 0))
        screw(stuck, rest, dt);
    else if (stuck)
        search(dt);
    else
        comply(dt);
    if (searchMs_ > parameters_.patience)
        change(Act::DrawBack);
    else if (attemptMs_ > kAttemptMs)
        change(Act::Retreat);
}

/// How far the thread still has to turn, up to a constant, mm on kLever.
double InsertingHand::twistLeft() const noexcept { return goal_.lead > 0 ? seen_[4] : -seen_[4]; }

/// Turns the tool in on its thread. If that is blocked, or does not move the tool, the tool turns back until it drops
/// far enough to show that the thread has found its beginning.
void InsertingHand::screw(bool stuck, double rest, double dt) noexcept {
    const double way = twistLeft();
    const auto begin = [&](Thread thread) {
        thread_ = thread;
        stuckMs_ = 0;
        least_ = thread_ == Thread::In ? way : INFINITY;
        from_ = way;
        height_ = rest;
    };
    if (thread_ == Thread::None) begin(Thread::In);
    if (thread_ == Thread::In) {
        turn(true, dt);
        if (rest < height_ - kProgress) {
            height_ = rest;
            from_ = way;
        }
        if (stuck || from_ - way > kMissedTurns * kTau * kLever) begin(Thread::Back);
    } else {
        turn(false, dt);
        searchMs_ += dt;
        attemptMs_ += dt;
        height_ = std::max(height_, rest);
        if (rest < height_ - kDrop * std::abs(goal_.lead) || way - from_ > kBackTurns * kTau * kLever)
            begin(Thread::In);
    }
}

void InsertingHand::turn(bool in, double dt) noexcept {
    const double sign = (goal_.lead > 0) == in ? -1 : 1;
    const double twist = target_[4] + sign * kLever * parameters_.turnSpeed * dt;
    comply(dt);
    // The spring must also overcome the hand's own damping.
    const HandParameters& h = parameters_.hand;
    const double lead = kMaxTwistLead + kLever * parameters_.turnSpeed * h.torsionDamping / h.torsionSpring;
    target_[4] = std::clamp(twist, held_[4] - lead, held_[4] + lead);
}

void InsertingHand::search(double dt) noexcept {
    const InsertingParameters& h = parameters_;
    if (stuckMs_ <= kStuckMs + dt) {
        searchCenter_ = held_.cwiseMax(-kMaxCenter).cwiseMin(kMaxCenter);
        searchCenter_[4] = held_[4];
        spiralAngle_ = stillMs_ = 0;
        rested_ = seen_;
    }
    searchMs_ += dt;
    attemptMs_ += dt;
    const int strategy = static_cast<int>(attemptMs_ / kStrategyMs), repeated = strategy / 2 + attempts_;
    const Place before = target_;
    comply(dt);
    if (strategy % 2 == 0 || segment().turns) {
        const double pitch = std::max(h.pitch, kCoarse * std::exp2(-strategy / 2));
        const double radius = pitch * spiralAngle_ / kTau;
        spiralAngle_ = radius > h.spiral ? 0 : spiralAngle_ + h.spiralSpeed * dt / std::max(radius, pitch);
        target_[0] = searchCenter_[0] + radius * std::cos(spiralAngle_);
        target_[2] = searchCenter_[2] + radius * std::sin(spiralAngle_);
        // The sweep is along the axis where the tool should turn, and otherwise about it.
        const int swept = segment().turns ? 1 : 4;
        const double sweep = swept == 1 ? kPastWay : kLever * std::min(h.sweep, kFirstSweep * std::exp2(repeated)),
                     speed = swept == 1 ? h.spiralSpeed : kLever * h.sweepSpeed;
        if (sweepSign_ * (before[swept] - searchCenter_[swept]) > sweep ||
            sweepSign_ * (before[swept] - held_[swept]) > kMaxTwistLead)
            sweepSign_ = -sweepSign_;
        target_[swept] = before[swept] + sweepSign_ * speed * dt;
    } else {
        const double ms = attemptMs_ - strategy * kStrategyMs, angle = kGoldenAngle * repeated;
        const double tilt = kLever * h.tilt * std::clamp(std::min(ms / 300, (2700 - ms) / 2000), 0.0, 1.0);
        const double x = std::cos(angle), z = std::sin(angle);
        target_[3] = tilt * z;  // the side toward (x, z) is the lowest
        target_[5] = -tilt * x;
        if (ms < 700) {
            const double shift = h.tiltShift * (repeated % 3);
            target_[0] = searchCenter_[0] - shift * x;
            target_[2] = searchCenter_[2] - shift * z;
        }
    }
    stillMs_ += dt;
    if ((seen_ - rested_).norm() > kStill) {
        rested_ = seen_;
        stillMs_ = 0;
    }
    const double behind = std::hypot(target_[0] - held_[0], target_[2] - held_[2]);
    eased_ = eased_ ? behind > kFollows : behind > kSticks && stillMs_ > kStillMs;
}

/// The displacement from goal to tool as the hand sees them, on the axes of the segment. Rotations that lead to an
/// equivalent goal do not count.
InsertingHand::Place InsertingHand::fromGoal() const noexcept {
    const Pose X_VT = X_WV_.inverse() * X_WT_seen_;
    const Quat q = X_VT.q * expRotation({0, foldedTwist(X_VT.q, goal_.fold) - twistOf(X_VT.q), 0});
    const Quat toSegment = segment().X_GS.q.conjugate();
    Place place;
    place << toSegment * X_VT.p, kLever * (toSegment * logRotation(q));
    if (goal_.toleranceAngle > 3) place.tail<3>().setZero();
    return place;
}

bool InsertingHand::isSeenAtGoal(double share) const noexcept {
    const Place from = fromGoal();
    return from.head<3>().norm() <= share * goal_.tolerance &&
           from.tail<3>().norm() <= share * kLever * goal_.toleranceAngle;
}

void InsertingHand::settle(double dt) noexcept {
    Place from = fromGoal();
    // What is well within the tolerances is left as the parts hold it.
    if (from.head<3>().norm() <= 0.5 * goal_.tolerance) from.head<3>().setZero();
    if (from.tail<3>().norm() <= 0.5 * kLever * goal_.toleranceAngle) from.tail<3>().setZero();
    const Place goal = held_ - from.cwiseMax(-kSettle).cwiseMin(kSettle);
    target_ = goal + std::exp(-dt / kComplyMs) * (target_ - goal);
    if (actMs_ > kMaxSettleMs || (actMs_ > kSettleMs && isSeenAtGoal(0.5))) change(Act::Release);
}

void InsertingHand::retreat(double dt) noexcept {
    const double lead = parameters_.press / parameters_.hand.spring;
    const double rest = -segment().in.dot(seen_), held = -segment().in.dot(held_), target = -segment().in.dot(target_);
    target_ += (target - std::min(target + 2 * parameters_.speed * dt, held + lead)) * segment().in;
    if (thread_ != Thread::None)
        turn(false, dt);
    else
        comply(dt);
    const double outside = segment_ > 0 ? segment().length - kPastWay : begins();
    const bool out = rest > outside || actMs_ > kRetreatMs;
    if (!out) return;
    if (segment_ > 0) {
        enter(segment_ - 1);
    } else {
        look();
        target_ = placeOf(segment(), X_WB_.inverse() * hand_.pose(), target_);
        change(Act::Approach);
    }
}

InsertingHand::Place InsertingHand::withTremor(double t) const noexcept {
    if (act_ == Act::Release) return target_;
    std::array<double, 6> shake;
    for (std::size_t i = 0; i < shake.size(); ++i) shake[i] = std::sin(tremor_[2 * i] * t + tremor_[2 * i + 1]);
    const double mm = parameters_.tremor, turn = kLever * parameters_.tremorAngle;
    Place place = target_;
    for (int i = 0; i < 3; ++i) {
        place[i] += mm * shake[static_cast<std::size_t>(i)];
        place[3 + i] += turn * shake[static_cast<std::size_t>(3 + i)];
    }
    return place;
}

void InsertingHand::engage(const Pose& X_WT) noexcept {
    hand_.reset(X_WT);
    X_WT_seen_ = X_WT;
    segment_ = 0;
    target_ = placeOf(segment(), X_WB_.inverse() * X_WT, Place::Zero());
    change(Act::Approach);
}

std::unique_ptr<Device> makeInsertingHand(const DeviceContext& context) {
    if (!context.goal)
        throw std::runtime_error("this scene has no goal: give a node the role goal, or choose another --device");
    InsertingParameters parameters;
    const char *first = context.file.data(), *last = first + context.file.size();
    if (!context.file.empty()) {
        const auto [end, error] = std::from_chars(first, last, parameters.seed);
        if (error != std::errc() || end != last)
            throw std::runtime_error("'" + context.file +
                                     "' is not a seed: write --device insert:SEED with a whole number");
    }
    return std::make_unique<InsertingHand>(context.X_WT_start, *context.goal, parameters);
}

}  // namespace touchstone
