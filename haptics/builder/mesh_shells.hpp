#pragma once
// Shells: faces joined across the edges that two of them share; which of them bound a volume, and from which side.
#include <optional>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/mesh_weld.hpp"

namespace touchstone {

/// Turns, closes and sorts the faces of a welded mesh as repairMesh() promises. Lengths in the frame of RepairedMesh.
class Shells {
  public:
    /// Takes vertices and faces over. `pulse` must outlive it.
    Shells(WeldedMesh&& mesh, Pulse& pulse);
    Shells(const Shells&) = delete;  // its edges refer to its faces
    Shells& operator=(const Shells&) = delete;

    int holes() const { return holes_; }
    bool anyClosed() const { return !walls_.empty(); }

    /// Whether a sheet lies in the closed shells, as far as its middle and its corners tell.
    bool enclose(const Triangle& sheet);

    /// All faces with their roles, shell by shell.
    void append(std::vector<Face>& out);

  private:
    struct Shell {
        bool closed = false;
        double volume = 0;  ///< signed, as the faces came in
        int firstCap = 0, lastCap = 0;
        Box box;
    };
    /// Where a face is missing.
    struct Gap {
        int shell, low, high;
        bool rises;  ///< the face that is there runs from low to high
    };

    Corners cornersOf(int face) const;
    Triangle triangle(const Corners& c) const { return {vertices_[c[0]], vertices_[c[1]], vertices_[c[2]]}; }
    bool rises(const EdgeTable::Edge& e, int use) const;

    void orient();
    void group();
    std::vector<char> openGroups() const;
    bool dropFlaps();
    void makeShells();
    void measure(int shell, std::span<const Gap> gaps);
    int cone(std::span<const Gap> gaps);
    void turn(int shell);
    void nest();
    void bury();
    bool inside(const Vec3& p);
    bool insideBothSides(const Vec3& p, const Triangle& t);

    Pulse& pulse_;
    std::vector<Vec3> vertices_;  ///< with the apexes of caps at the end
    const std::vector<Corners> faces_;
    const EdgeTable edges_;
    std::vector<EdgeTable::Edge> odd_;  ///< edges that are not just two faces of one patch that agree
    std::vector<char> turned_;          ///< by face: it runs the other way round
    std::vector<int> shellOf_;          ///< by face: first the patch joined by edges of two, in the end the shell
    std::vector<int> groupOf_;          ///< by patch: those of one group make a shell
    std::vector<double> patchArea_;
    std::vector<Shell> shells_;
    Grouped facesOf_;  ///< by shell
    std::vector<Corners> caps_;
    std::vector<Corners> walls_;        ///< faces and caps of closed shells
    std::vector<int> wallFace_;         ///< by wall; -1 for caps
    std::vector<char> buried_;          ///< by face
    std::optional<TriangleBvh> field_;  ///< the walls, once it pays
    int asked_ = 0;
    int holes_ = 0;
};

}  // namespace touchstone
