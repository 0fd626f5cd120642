#pragma once
// Plans a cover: finds the least growth for a given number of balls, or the fewest balls for a given growth.
#include "haptics/builder/build_progress.hpp"
#include "haptics/builder/sphere_cover.hpp"

namespace touchstone {

/// Input of the search for a cover. Lengths in the frame of RepairedMesh.
struct CoverTask {
    const RepairedMesh& mesh;
    const SolidDepth& solid;
    const CoverCertificate& certificate;
    TreeQuality quality;
    std::uint64_t seed;
    const Workers& workers;
    Progress& progress;
};

/// Finds a proven cover of at most `maxBalls` balls with as little growth as it can. Always succeeds.
Cover tightestCover(const CoverTask& task, std::size_t maxBalls);

/// Finds a proven cover of the given growth with as few balls as it can. The result is unproven if the cover needs more
/// than `maxBalls`.
Cover smallestCover(const CoverTask& task, double growth, std::size_t maxBalls);

}  // namespace touchstone
