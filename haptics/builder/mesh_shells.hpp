#pragma once
// Joins faces into shells at the edges that two of them share, and decides which shells bound a volume and on which
// side.
#include <optional>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/mesh_weld.hpp"

namespace touchstone {

/// Orients, closes and classifies the faces of a welded mesh as repairMesh() describes. Lengths in the frame of
/// RepairedMesh.
class Shells {
  public:
    /// Takes ownership of the vertices and faces. `apart`: how far rounding may have moved two equal points of the
    /// input apart. `pulse` must outlive the object.
    Shells(WeldedMesh&& mesh, double apart, Pulse& pulse);
    Shells(const Shells&) = delete;  // its edges refer to its faces
    Shells& operator=(const Shells&) = delete;

    int holes() const;  ///< number of small holes that caps close by guess
    /// Holes that a flat or smooth cap closes.
    const std::vector<MeshPatch>& closedHoles() const { return closedHoles_; }
    /// Number of shells that became sheets since they are inside out in part.
    int insideOut() const { return insideOut_; }
    bool anyClosed() const { return !walls_.empty(); }
    /// Number of faces of closed shells whose orientation is not that of the input.
    int turned() const;

    /// Whether a sheet lies inside the closed shells. Only its middle and its corners are tested.
    bool encloses(const Triangle& sheet);

    /// Appends all faces with their roles, shell by shell. The faces of caps that close a hole for sure are walls, and
    /// are appended to `sure` again.
    void append(std::vector<Face>& out, std::vector<Triangle>& sure);

    /// Adds the vertices of the faces of each loose sheet: nearly flat, outside the closed shells, and small together
    /// with all other loose sheets. `sheets` has those that hang on the shells, of area `attached`; they are removed if
    /// all together are not small. Returns whether there is any. Pre: append() was called.
    bool addLooseSheets(double attached, std::vector<std::vector<int>>& sheets);
    /// All faces but those of loose sheets. Pre: addLooseSheets() was called.
    std::vector<Corners> keptFaces() const;
    const std::vector<Vec3>& vertices() const { return vertices_; }
    Triangle triangle(const Corners& c) const { return {vertices_[c[0]], vertices_[c[1]], vertices_[c[2]]}; }

    /// The buried faces of closed shells, as vertices.
    std::vector<Corners> buriedWalls() const;
    /// All vertices, and the walls and caps as vertices.
    std::pair<std::vector<Vec3>, std::vector<Corners>> walls() &&;

  private:
    struct Shell {
        bool closed = false, cavity = false;
        bool loose = false;  ///< a sheet that addLooseSheets() found loose
        double volume = 0;   ///< signed, with the orientation that the faces had in the input
        int firstCap = 0, firstGuess = 0, lastCap = 0, holes = 0;  ///< caps from firstGuess on are guessed
        Box box;
    };
    /// A missing use of an edge: a place where a face is missing.
    struct Gap {
        int shell, low, high;
        bool rises;  ///< the existing face runs from low to high
        int face;    ///< one that runs so
    };

    Corners cornersOf(int face) const;
    bool rises(const EdgeTable::Edge& e, int use) const;

    void orient();
    void group();
    std::vector<char> openGroups() const;
    bool dropFlaps();
    void makeShells();
    void measure(int shell, std::span<const Gap> gaps);
    std::vector<Gap> closeHoles(std::span<const Gap> gaps, double area, bool& opening);
    int addCones(std::span<const Gap> gaps);
    void flip(int shell);
    void nest();
    void collectWalls();
    bool markBuried();
    double winding(const Vec3& p);
    bool inside(const Vec3& p) { return winding(p) >= 0.5; }
    bool insideBothSides(const Vec3& p, const Triangle& t);

    Pulse& pulse_;
    const double thinnestLobe_;   ///< thickness above which a part that is inside out counts
    std::vector<Vec3> vertices_;  ///< the apexes of caps are at the end
    const std::vector<Corners> faces_;
    const EdgeTable edges_;
    std::vector<EdgeTable::Edge> odd_;  ///< edges other than those between two consistent faces of one patch
    std::vector<char> flipped_;         ///< by face: its orientation is flipped
    std::vector<int> shellOf_;          ///< by face: first its patch (joined at edges of two faces), finally its shell
    std::vector<int> groupOf_;          ///< by patch: the patches of one group make a shell
    std::vector<double> patchArea_;
    std::vector<Shell> shells_;
    Grouped facesOf_;  ///< by shell
    std::vector<Corners> caps_;
    std::vector<MeshPatch> closedHoles_;
    std::vector<int> exposed_;          ///< number of exposed faces by shell
    std::vector<Corners> walls_;        ///< faces and caps of closed shells
    std::vector<int> wallFace_;         ///< by wall; -1 for caps
    std::vector<char> buried_;          ///< by face
    std::optional<TriangleBvh> field_;  ///< the walls, built once there are many queries
    int queries_ = 0;                   ///< number of calls of winding()
    int insideOut_ = 0;
};

}  // namespace touchstone
