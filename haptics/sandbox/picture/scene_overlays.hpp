#pragma once
// What a tick does, drawn over the scene: contacts, arrows, nearest pair, trace, spheres.
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/view/renderer.hpp"
#include "haptics/collision/clearance.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/sandbox/measure/contact_finder.hpp"
#include "haptics/sandbox/picture/display_options.hpp"

namespace touchstone::sandbox {

/// Length in the picture, in units of the tool's reach, of an arrow for a force in N: proportional while small, and
/// never longer than 1.8, so that it stays in the picture. A torque is shown as the force that makes it at the reach.
double arrowLength(double newtons);

/// Colour of a sphere of a tree: each level has its hue, and neighbors differ a little in hue and brightness, so that
/// each can be seen.
glm::vec4 sphereColor(bool tool, int level, int index);

/// Colour of a gap in mm: red where it is closed, over yellow and green to blue at kShownGap and beyond.
glm::vec3 gapColor(double gap);
inline constexpr double kShownGap = 1;  // mm

/// Where bodies touch, or come nearest.
struct ContactPlace {
    Vec3 p_W = Vec3::Zero();  ///< mm
    Vec3 n_W = Vec3::Zero();  ///< from the obstacle to the tool, by load; shorter than 1 where normals differ
    double reach = 0;         ///< mm from p_W to the furthest contact
};

/// The way of C, mm: points at least a spacing apart, the oldest dropped beyond a number.
class ToolTrace {
  public:
    explicit ToolTrace(double spacing) : spacing_(spacing) {}
    /// Forgets all when `tick` is not later than the last: the run began anew.
    void add(const Vec3& p_WC, std::uint64_t tick);
    const std::deque<Vec3>& points() const { return points_; }

  private:
    double spacing_;
    std::uint64_t last_ = 0;
    std::deque<Vec3> points_;
};

/// Finds and draws what DisplayOptions asks of a tick. One thread.
class SceneOverlays {
  public:
    explicit SceneOverlays(std::shared_ptr<const World> world);

    /// Where the obstacles are from now on, X_WO by obstacle; at first where the world starts them.
    void place(std::span<const Pose> X_WO) { finder_.place(X_WO); }

    /// To be called with every tick that the trace is to show.
    void follow(const TickRecord& record);

    /// Finds the contacts and the nearest pair of a tick for what follows, as far as `options` needs them.
    void find(const TickRecord& record, const Settings& settings, const DisplayOptions& options);
    std::optional<ContactPlace> contactPlace() const { return place_; }  ///< the mean of all contacts
    std::optional<ContactPlace> nearestPlace() const;                    ///< where clearance is asked for

    /// Appends what find() found and all else to the frame, seen with frame.camera and cut by frame.section.
    void add(engine::Frame& frame, const TickRecord& record, const DisplayOptions& options) const;
    /// Likewise the spheres, which are there before the first tick.
    void addSpheres(engine::Frame& frame, const Pose& X_WT, const DisplayOptions& options) const;

  private:
    struct Nearest {
        Vec3 p_W, q_W;  ///< on the tool and on the obstacle
        Vec3 n_W;
        double gap = 0;
    };
    void findNearest(const Pose& X_WT);
    void addContacts(engine::Frame& frame, double unit) const;
    void addArrows(engine::Frame& frame, const TickRecord& record, bool values, double unit) const;
    void addTree(engine::Frame& frame, const SphereTree& tree, const Pose& X_WB, int level, bool tool,
                 const std::vector<float>* gaps) const;

    std::shared_ptr<const World> world_;
    double reach_;  ///< ρ, mm
    ContactFinder finder_;
    ToolTrace trace_;
    std::vector<ContactPoint> contacts_;
    std::optional<ContactPlace> place_;
    std::vector<LeafPair> nearestPairs_;  ///< per obstacle
    std::optional<Nearest> nearest_;
    std::vector<float> toolGaps_;                   ///< per leaf, mm
    std::vector<std::vector<float>> obstacleGaps_;  ///< per obstacle and leaf
    std::uint64_t gapsDue_ = 0;                     ///< ns, to be found anew
};

}  // namespace touchstone::sandbox
