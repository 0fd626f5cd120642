#pragma once
// Every tuning constant of the tick: its unit, what a larger or smaller value does, and its source. A value whose
// comment names no source was measured on the bundled scenes and their hard motions. Where a comment names no unit,
// lengths are in mm, angles in rad and forces in N. Users choose settings instead (haptics/loop/settings.hpp). Bounds
// on rounding stand beside the arithmetic that they bound, and the constants of a baseline in its file.
#include <cstddef>
#include <limits>

namespace touchstone {

// The steps of a tick. On springs of 1 N/mm, 1 µm is 1 mN.

/// A step up to this length ends the tick. A larger value leaves the tool short of its place.
inline constexpr double kFelt = 1e-3;
/// A step that known contacts alone make shorter than this is not made. A larger value leaves a moving tool behind its
/// place, always on the same side: a nut turns with 0.7 % less torque at 1 µm. With a smaller one more steps are swept.
inline constexpr double kUnmoved = 1e-4;
/// The same for the first step of a tick: a resting tool is off by as much, 0.01 µN. A smaller value moves resting
/// tools by what rounding makes of their rows.
inline constexpr double kRests = 1e-8;
/// Known contacts keep their rows up to this multiple of the distance that is kept. With a larger value the tool is
/// held where it no longer touches: at 2 a nut needs 1.8 % more torque. With a smaller one resting contacts are found
/// again.
inline constexpr double kFaces = 1.05;
/// A row stands on its features if their nearest points lie outside them by at most this. With a larger value a row
/// holds a pointed tool on the joint of two flush parts; with a smaller one rows are dropped, and crossed again.
inline constexpr double kBesideFeatures = 1e-4;
/// A step up to this length must not end on rows beside their features, since it may end the tick; nor must one that
/// takes back the last. With a larger value rows are dropped that the next step would not cross.
inline constexpr double kMayEnd = 5 * kFelt;
/// Longest step: a longer one bends further from its rows. A smaller one takes more steps.
inline constexpr double kLongestStep = 0.25;
/// Length of the first part that is swept of a step that is more than twice as long. A longer part crosses pairs in
/// threads that the answer never comes near; a shorter one takes more sweeps.
inline constexpr double kFirstPart = 0.03;
/// Part of the tick's travel that a damped step may take. With all of it bunnies hover by 25 µm beside faces that
/// they have just left.
inline constexpr double kOfTravel = 0.95;
/// A damped step is short enough if what it may be is within these multiples of it, and one or two solves find the
/// damping. More solves come closer; the rest is cut off.
inline constexpr double kSlightlyLong = 0.98, kSlightlyShort = 1.1;
inline constexpr int kSolvesForDamping = 4;
/// The tool flies if the device is farther than this many longest steps. A shorter path is swept as fast.
inline constexpr double kFlies = 2;
/// Maximum turn of a flight, rad: its points may leave their straight paths by reach x turn²/2, which ends it early.
inline constexpr double kTurnOfFlight = 0.2;
/// Factor by which the steps of a tick become shorter if the pairs of one are too many to be found or crossed.
inline constexpr double kShortenedBy = 16;
/// Work of a tick, in rows, summed over its sweeps and steps: a sweep counts as that of its rows and kWorkOfSweep more,
/// and a step as kWorkOfTravel such sweeps for each mm, since it leads to other pairs, which must be found. A tick that
/// has spent its work ends with the step that it has made. With more, ticks after leaps beside threads become longer;
/// with less, ticks in threads do not arrive. Pairs would measure the time better, but how many are listed depends on
/// which thread found them, and the result must not.
inline constexpr int kWork = 1 << 14, kWorkOfSweep = 32;
inline constexpr double kWorkOfTravel = 48;
/// A tick ends with the step with which its answers have taken back the one before them this often: they lead around a
/// place that none of them reaches. With more, such ticks take longer; with fewer, wedged tools arrive later.
inline constexpr int kReturns = 8;
/// Leaves have a row from the first solve on up to this part of the margin. With a larger one solves have more rows;
/// with a smaller one a step takes more of them.
inline constexpr double kNearLeaves = 0.04;
/// Maximum number of rows of leaves in the first solve. Deep overlaps exceed it; then it has the nearest pair of each
/// leaf of the tool. With more, such ticks take longer; with fewer, ordinary deep contacts take more solves.
inline constexpr int kMostLeafRows = 4096;
/// Maximum number of solves of a step, after which it is halved until it brings nothing too near; three to ten are
/// usual.
inline constexpr int kSolvesOfStep = 64, kHalvesOfStep = 24;
/// Fraction of the deepest crossing down to which crossed rows are taken in one pass. The deepest rows come first,
/// since an answer that satisfies them crosses few of the others. With a larger fraction a step needs more solves; with
/// a smaller one the next solve has more rows.
inline constexpr float kDeepestFraction = 0.5f;
/// Overlap that one linearization may leave, mm; a gap that ends below it and below its old value shortens the move.
/// The accuracy target for penetration is 1 µm, and the second-order error of a rotation is up to t²/2ρ (2 µm on the
/// bunny). A larger value lets overlaps grow from tick to tick; a smaller one halves moves for the sake of rounding.
inline constexpr double kOverlapTolerance = 0.5e-3;
/// An approximate answer that violates a row by more than this is projected onto the rows, mm. kOverlapTolerance is 500
/// times as large. A larger value lets violations through; a smaller one projects answers that are correct to rounding.
inline constexpr double kViolation = 1e-6;

// Moving obstacles.

/// Maximum speed of an obstacle on the way to its target, mm/ms. A faster obstacle pushes the tool in larger steps,
/// more of which are refused because a pair would overlap; a slower one lags behind the user who drags it.
inline constexpr double kObstacleSpeed = 0.25;
/// Lower bound of the fraction of the maximum move that an obstacle tries. Refused moves halve the fraction; at 1 kHz
/// the bound is a move of about 1 µm a tick. A smaller bound makes an obstacle take longer to get going again.
inline constexpr double kSmallestPace = 1.0 / (1 << 8);

// Features: the distance that is kept.

/// Fraction of the distance that is kept below which a pair is too near. With a larger one a capped step cannot make up
/// for what its own turn bends, and is halved again and again; with a smaller one features come nearer.
inline constexpr double kTooNear = 0.5;
/// Fraction of the distance that is kept below which a trial step must not bring a pair. With a larger one, pairs that
/// rest at that distance can no longer be left out by tests in float, which takes time in every tick. With a smaller
/// one the tool may rest where features are nearer than is kept, off by as many micrometers as corners make of it.
inline constexpr double kNear = 0.95;
/// Angle between normals up to which they are the same, rad: it turns a force of 1 N by 1 mN. With a larger one a force
/// may point past its face by as much; with a smaller one rounding makes neighbors in one plane differ.
inline constexpr double kSameNormal = 1e-3;
/// Angle by which features that begin inside a part may fail to stand on what they touch, rad: those that would keep a
/// flush side from leaning may be the ones inside. With a larger one the tool is held by what is not the first in its
/// way; with a smaller one it leans and passes through a side at less force.
inline constexpr double kLean = 0.01;

// Whether a motion is free.

/// The smallest part of a motion that is searched after longer ones took more than the budget. With a smaller one
/// more searches are made in vain.
inline constexpr double kLeastShare = 1.0 / 128;
/// Bounds on the gap of two features that move: the maximum number of parts of a motion at whose ends the pair is
/// measured, and the length of a part, mm. More parts bound the gap more closely, so that fewer pairs are kept, and
/// take more time. Whether a motion counts as free depends on them.
inline constexpr int kMotionParts = 6;
inline constexpr float kPartLength = 0.2f;
/// A motion up to this length, mm, is measured at its middle alone: the bound is smaller by at most half of it.
inline constexpr float kShortLength = 0.03f;
/// Parts of which a quick bound measures only the middles. With one, the direction in which a pair is apart is off on
/// long motions, so that its separation keeps more pairs; more take more time.
inline constexpr int kQuickParts = 2;

// Friction.

/// ρ in Newton's steps, relative to the springs' stiffness at the contact, and the share of it in the first round. A
/// larger ρ loses digits. A smaller one needs more corrections of the forces, and misses contacts that clamp a small
/// part, whose rotational springs are stiffer than its translational ones. Steps that circle with one value often
/// converge with the other.
inline constexpr double kPenalty = 1e5, kFirstRound = 1e-2;
/// Maximum number of Newton steps before f⁰ is held. Ticks that differ little from the last one take 2 to 8; steps
/// that have not converged after 20 mostly circle.
inline constexpr int kNewtonSteps = 20;
/// Warm start: a force within this share of its cone's edge starts as sliding, any other as sticking. The normal turns
/// between two linearizations, and the edge with it. With a smaller value sliding contacts start as sticking, and
/// Newton's steps often circle from there.
inline constexpr double kAtEdge = 1e-3;
/// Convergence: the greatest imbalance, and the greatest change of a force in the last correction, relative to the
/// forces, which count as at most kMostForce, N. The change is ρ times the gaps and slips of contacts that touch and
/// stick: 1e-15 mm for 1 N. Forces of contradicting contacts grow without bound, so without kMostForce any answer
/// would pass.
inline constexpr double kBalanced = 1e-11, kForcesSettled = 1e-10, kMostForce = 1e4;
/// Early rounds end at this imbalance, relative to the change of the forces, since the change moves the next answer
/// further. A smaller value takes more steps in each round; with 0.1, rounds with redundant contacts stall. It is also
/// relative to the forces, since the forces of a clamped tool may change by far more than the springs pull.
inline constexpr double kNearlyBalanced = 0.02;
/// Newton's steps are given up after this many evaluations with an imbalance greater than all forces and than at the
/// first step: too many contacts then have the wrong mode (open, stick or slide). One such evaluation often does no
/// harm.
inline constexpr int kWildSteps = 2;
/// Maximum number of rounds, of Newton steps in each, and of falls of ρ; the factor by which ρ grows, its lower bound,
/// and the bound on the product of all factors. Nearly parallel contacts settle slowly with a small ρ; with a large one
/// the steps circle. Then ρ falls by the square of the factor, and the factor becomes smaller. The rounds are given up
/// if the error has not halved in half of them. They continue while each halves the error, down to kConverged, so that
/// rounding does not decide where they end.
inline constexpr int kRounds = 60, kRoundSteps = 10, kFalls = 12;
inline constexpr double kGrowth = 6, kLeastGrowth = 2, kMostGrowth = 1e4, kConverged = 1e-13;
/// Error at which an answer is good enough, mm: rows that contradict each other by rounding leave as much.
inline constexpr double kErrorSettled = 1e-9;
/// Greatest overlap, mm, and imbalance, N, of an answer that is not exact and counts as regularized.
inline constexpr double kRegularized = 3e-4;
/// Lower bound on the share of the slip in w_t. The share is 0 where a contact begins to slide, and the direction of
/// its force has no derivative there.
inline constexpr double kLeastSlip = 0.05;
/// Continuation: ρ begins at 1/kDecades of the springs and ends at kDecades^5. At kDecades^2 and at each further factor
/// of kDecades, rounds try to finish. The rounding of corners begins as large as the forces and falls as ρ^-1/2.
inline constexpr double kDecades = 100;
/// Tolerance of a point on the path: its imbalance relative to the forces, and the least step in log ρ. The imbalance
/// that rounding causes if ρ is large, N. The maximum number of corrections of a point.
inline constexpr double kOnPath = 1e-6, kMostImbalance = 1e-7;
inline constexpr int kCorrections = 6;
/// Bound on the evaluations, each O(contacts). The Newton steps take 3 to 20, rounds 2 to 150, a path 50 to 500. A
/// smaller bound leaves more ticks without an exact answer; a larger one makes the longest ticks longer.
inline constexpr int kEvaluationsOfSolve = 1500;
/// Number of evaluations by the exact solver for friction, summed over its solves, with which a tick ends kUnfinished.
/// It bounds the time of a tick in which steps lead to and fro between answers that are hard to find. Dozens are usual,
/// thousands where a tool is clamped; with a smaller number such a tool arrives later.
inline constexpr int kEvaluationsOfTick = 10000;
/// Slip of a contact in a tick above which it slides, mm: 0.1 µm/s at 1 kHz. Contacts that take over load from others
/// give way by less, and what sticks by up to 1e-9 mm.
inline constexpr double kSlips = 1e-7;
/// Maximum number of rounds in which crossed rows are added. Three are usual.
inline constexpr int kCrossedRounds = 64;

// Lists of near pairs. These constants change the time of a tick and never its result, since a query tests every pair.

/// Number of entries up to which a set is used as it is. Selecting fewer from so few costs more than testing all.
inline constexpr int kFewEntries = 64;
/// A narrow set whose remaining reserve exceeds this multiple of its intended reserve is selected again, since it makes
/// every query test too many entries. A larger multiple keeps wide sets longer; a smaller one selects more often.
inline constexpr double kMaxReserve = 3;
/// Factor on the curve term of what a search is asked for. It leaves room for longer steps, up to √2 times as long,
/// before another search is needed; a larger factor finds more pairs.
inline constexpr double kCurveReserve = 2;
/// Number of ticks that a selection of the narrow set looks ahead along the expected motion. More ticks select more
/// entries; fewer select more often.
inline constexpr double kNarrowTicks = 2;
/// Smallest part of the reserve and the look-ahead. With a smaller one the sets of crowded places serve no further
/// tick.
inline constexpr double kLeastReach = 1.0 / 64;
/// Least length of a look-ahead, mm: below it the tool counts as resting, and the search is made around its pose.
inline constexpr double kMinLookAhead = 0.01;
/// How far a list looks ahead.
struct LookAhead {
    /// Reserve of the narrow set, as a fraction of that of the wide set. With a larger reserve every query tests more
    /// entries; with a smaller one the set is selected again more often.
    double narrow = 0.12;
    /// Number of ticks that a search looks ahead along the expected motion. More ticks find more entries; fewer search
    /// more often. A shaft on its way into a hole moves straight, so that one search serves up to eight ticks.
    double ticks = 8;
    /// Upper bound on the length of that look-ahead, mm, which bounds the number of entries of a fast tool.
    double most = 2;
    /// Whether the narrow set is selected for all steps of a tick that is too fast for looking further ahead. It then
    /// holds more entries, which pays where a tick selects it again for each of many steps.
    bool wholeTicks = false;
    /// A search has twice the slack if the last one found some entries, but fewer than this: it takes its time for the
    /// trees then, and hardly more for a wider margin. With a larger number the sets of fits become larger; with a
    /// smaller one tools that turn fast search more often.
    int sparse = 0;
    /// A search looks half as far ahead, with half the slack, if one of the last two found more entries than this. It
    /// then takes its time for the entries; a shorter longest tick is worth more searches. With a smaller number the
    /// median tick of fits selects its entries more often.
    int dense = std::numeric_limits<int>::max();
    /// A search that finds more entries than this halves the reserve and the look-ahead of all that follow, until one
    /// finds less than an eighth, or another thread finds them. With a larger number parts that are small beside the
    /// reserve take milliseconds a search; with a smaller one fits search more often.
    int crowded = std::numeric_limits<int>::max();
};
/// Chosen by measurement on the bunnies, the spline and the nut: there are few pairs of features, and finding them is
/// the tail.
inline constexpr LookAhead kFeatureLookAhead{
    .narrow = 0.3, .ticks = 4, .most = 0.8, .wholeTicks = true, .sparse = 128, .dense = 2000, .crowded = 1 << 14};
/// The pairs of a step are bounded by their radii (NeighborList::coverageOf()) if that bound, for mean radii, is below
/// this fraction of the margin. Otherwise all pairs within the margin are taken, since a test along the motion would
/// save too little.
inline constexpr double kUsefulFraction = 0.7;
/// Steps longer than this multiple of the margin are not bounded by their radii: they differ so much from each other
/// that a search along one does not serve the next.
inline constexpr double kLongStep = 2;
/// Number of entries of a set with separations. They take 40 bytes each; fits have up to some ten thousand pairs.
inline constexpr int kSeparated = 1 << 16;
/// Number of tests (SearchBudget) that measuring eight pairs on a motion counts as, by its time.
inline constexpr int kMeasure = 8;

// The list worker, whose lists change the time of a tick and never its result.

/// A new search begins when the motion of the published list ends in less than this time: kLeadMs plus kLeadPerSearch
/// times the duration of the last search. With less time a search ends after its entries are needed, and the tick has
/// to search itself; with more time searches are more frequent.
inline constexpr double kLeadMs = 2, kLeadPerSearch = 2;
/// Time by which the motion searched is longer than that lead, ms. A longer time makes longer lists, of which a tick
/// tests more entries; a shorter one searches more often. Chosen by measurement on the splined peg, where 6 ms was
/// slower.
inline constexpr double kUseMs = 2;
/// Maximum length of the motion searched, mm, between spheres and between meshes: the upper bound on the size of its
/// list for a fast tool. With a longer one the tick selects from more entries, of which few lie where the tool goes;
/// with a shorter one it searches more often itself. Between meshes, 2.5 mm take up to a third more time, most in a
/// nut.
inline constexpr double kMaxSearch = 2.5, kMaxMeshSearch = 1.2;
/// A new search also begins when this fraction of the slack is used up by deviation from the motion. A larger fraction
/// leaves less time for the search; a smaller one searches more often.
inline constexpr double kUsedSlack = 0.4;
/// Between meshes a search has twice the slack if the last one found fewer entries than this. With a larger number the
/// sets of fits become larger; with a smaller one the tick searches more often itself.
inline constexpr int kSparse = 1000;
/// The tool rests if it travels less than this fraction of the slack in a tick. The list of the long motion that
/// brought it there is then replaced, since most of its entries would be tested in vain.
inline constexpr double kResting = 0.02;
/// Maximum deviation of the tool from the straight motion through its earlier pose, as a fraction of the slack. If it
/// deviates less, the motion searched begins at that earlier pose. A larger fraction uses up slack that later motion
/// needs.
inline constexpr double kStraight = 0.25;
/// Pause between looks at the mailbox, in ticks, and its minimum in ms. The thread polls, so that no tick has to wake
/// it. A longer pause uses older poses; a shorter one costs processor time.
inline constexpr double kPollTicks = 0.8, kMinPollMs = 0.1;

// Capacities, and the work of searches.

/// Maximum number of contact rows of a solve. A tool that starts inside an obstacle lists up to 100,000 pairs; of more
/// pairs than this, default mode takes the nearest pair of each tool leaf and sets kRowsTruncated. A larger value costs
/// memory (64 bytes a row in each row set) and time in such ticks; a smaller one truncates earlier.
inline constexpr int kRowCapacity = 1 << 15;
/// Maximum number of rows that are remembered within a tick because a step ended on them; six carry the tool.
inline constexpr int kHeldRows = 64;
/// Maximum number of rows in paper mode: at 1,024 rows the matrix Q that PQP forms takes 8 MiB, and an iteration reads
/// all of it. The paper reports 50 to 200 pairs.
inline constexpr int kPaperRowCapacity = 1024;
/// Maximum number of rows that the shadow solver may be given (setting shadow_rows).
inline constexpr int kShadowRowCapacity = 4096;
/// Maximum number of entries of a list, and of candidate rows of a step. It bounds the memory (16 bytes an entry in
/// each set) and the time of the longest search; a tool deep inside an obstacle can exceed it, and the tick is then
/// held (kListOverflow). A start deep inside an obstacle was measured to list up to 100,000 rows.
inline constexpr int kEntryCapacity = 1 << 18;
/// Maximum number of crossed pairs of one trial step. Thousands cross where large conforming areas meet; if there are
/// more, the step is halved.
inline constexpr std::size_t kMostCrossed = 1 << 14;
/// Maximum number of block pairs of one depth in a run. Three arrays of this size (48 KiB) fit the first cache. With a
/// larger run they do not; with a smaller one the overhead of a run is spread over fewer pairs.
inline constexpr int kFrontier = 4096;
/// Tests (SearchBudget) of all searches of a tick, of one for a flight and of one for a list. A test takes some 20 ns.
/// One list of a bundled scene takes up to 130,000, as does a flight over a bunny, and a list of a thread of 40,000
/// triangles takes 170,000. A jump beside a thread or a gear, where a motion of millimeters sweeps most of two meshes,
/// would take ten million. With more tests a tick such ticks become longer; with fewer the tool arrives later, and a
/// flight that is found too long must leave some for a shorter one. With fewer for a list than a step of a micrometer
/// needs, a dense thread can neither be turned nor felt.
inline constexpr int kTestsOfTick = 3 << 16, kTestsOfFlight = 1 << 17, kTestsOfList = 1 << 18;

}  // namespace touchstone
