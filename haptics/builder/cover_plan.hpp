#pragma once
// How much balls have to grow for a given count, and how many it takes for a given growth.
#include "haptics/builder/build_progress.hpp"
#include "haptics/builder/sphere_cover.hpp"

namespace touchstone {

/// What a search for a cover works on. Lengths in the frame of RepairedMesh.
struct CoverTask {
    const RepairedMesh& mesh;
    const SolidDepth& solid;
    const CoverCertificate& certificate;
    TreeQuality quality;
    std::uint64_t seed;
    const Workers& workers;
    Progress& progress;
};

/// A proven cover of at most `most` balls and the least growth that it can find. Always succeeds.
Cover tightestCover(const CoverTask& task, std::size_t most);

/// A proven cover of the given growth and the fewest balls that it can find; unproven if that takes more than `most`.
Cover smallestCover(const CoverTask& task, double growth, std::size_t most);

}  // namespace touchstone
