#pragma once
// Overlays of a tick: contacts, arrows, nearest pair, trace, spheres.
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/view/renderer.hpp"
#include "haptics/collision/clearance.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/sandbox/measure/contact_finder.hpp"
#include "haptics/sandbox/measure/gap_map.hpp"
#include "haptics/sandbox/picture/display_options.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone::sandbox {

/// Drawn length of a force arrow, relative to the tool's reach, for a force in N: proportional for small forces and
/// below 1.8, so that it stays in the picture. A torque is shown as the force that causes it at the reach.
double arrowLength(double newtons);

/// Color of a sphere of a tree: each level has its own hue, and neighbors differ slightly in hue and brightness, so
/// that they can be distinguished.
glm::vec4 sphereColor(bool tool, int level, int index);

/// Color of a gap in mm: red at 0, then yellow and green, to gray at kShownGap and beyond.
glm::vec3 gapColor(double gap);
inline constexpr double kShownGap = 1;  // mm

/// Place where bodies touch or are nearest.
struct ContactPlace {
    Vec3 p_W = Vec3::Zero();  ///< mm
    Vec3 n_W = Vec3::Zero();  ///< from obstacle to tool, averaged by load; shorter than 1 if normals differ
    double reach = 0;         ///< distance from p_W to the farthest contact, mm
};

/// Path of C, mm: points at least `spacing` apart; the oldest are dropped beyond a maximum count.
class ToolTrace {
  public:
    explicit ToolTrace(double spacing) : spacing_(spacing) {}
    /// Clears the trace when `tick` is before the last one, since the run was reset then.
    void add(const Vec3& p_WC, std::uint64_t tick);
    const std::deque<Vec3>& points() const { return points_; }

  private:
    double spacing_;
    std::uint64_t last_ = 0;
    std::deque<Vec3> points_;
};

/// Computes and draws the overlays of a tick that DisplayOptions selects. Not thread-safe.
class SceneOverlays {
  public:
    explicit SceneOverlays(std::shared_ptr<const World> world);

    /// Sets where the obstacles are from now on, X_WO by obstacle; at first they are where the world starts them.
    void place(std::span<const Pose> X_WO) { finder_.place(X_WO); }

    /// Call with every tick that the trace should show.
    void follow(const TickRecord& record);

    /// Finds the contacts and the nearest pair of a tick, as far as `options` needs them, for the functions below.
    void find(const TickRecord& record, const Settings& settings, const DisplayOptions& options);
    std::optional<ContactPlace> contactPlace() const { return place_; }  ///< mean of all contacts
    std::optional<ContactPlace> nearestPlace() const;                    ///< only if clearance is shown

    /// The gaps of the parts that are touched by their meshes, if options.byGap: of the tool, then of each obstacle;
    /// empty for the others. They change with every increment of gapsNumber().
    std::span<const GapMap> gapMaps() const { return gapMaps_; }
    int gapsNumber() const { return gapsNumber_; }

    /// Appends all overlays except the spheres to the frame, for frame.camera and frame.section.
    void add(engine::Frame& frame, const TickRecord& record, const DisplayOptions& options) const;
    /// Appends the spheres, which exist before the first tick.
    void addSpheres(engine::Frame& frame, const Pose& X_WT, const DisplayOptions& options) const;

  private:
    struct Nearest {
        Vec3 p_W, q_W;  ///< on the tool and on the obstacle
        Vec3 n_W;
        double gap = 0;
    };
    void findNearest(const Pose& X_WT, Geometry geometry);
    void findGaps(const TickRecord& record, Geometry geometry, bool spheres);
    void addContacts(engine::Frame& frame, double unit) const;
    static void addCone(engine::Frame& frame, const ContactPoint& contact, double length);
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
    std::vector<FacePair> nearestFaces_;  ///< per obstacle
    std::optional<Nearest> nearest_;
    std::vector<std::vector<float>> leafGaps_;  ///< of the tool, then of each obstacle; per leaf, mm
    std::vector<GapMap> gapMaps_;
    int gapsNumber_ = 0;
    std::uint64_t gapsDue_ = 0;  ///< ns: time of the next update of the gaps; 0: at once
};

}  // namespace touchstone::sandbox
