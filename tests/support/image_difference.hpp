#pragma once
// The difference of two pictures of one scene, in numbers that tolerate drivers but detect changes.
#include <algorithm>
#include <cstdlib>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::test {

struct ImageDifference {
    double mean = 255;  ///< over all pixels and colors, of 255
    double share = 1;   ///< of pixels where the means over 3 x 3 pixels differ by more than kVisible in a color
    static constexpr int kVisible = 20;
};

/// Drivers place the samples of a pixel and round differently, which changes single pixels at edges and less elsewhere;
/// a mean over nine pixels hides it. Pictures of different sizes differ everywhere.
inline ImageDifference difference(const engine::Image& a, const engine::Image& b) {
    if (a.width != b.width || a.height != b.height || a.width < 3 || a.height < 3) return {};
    const auto at = [](const engine::Image& image, int x, int y, int c) {
        return int(image.rgba[4 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x)) + std::size_t(c)]);
    };
    double sum = 0;
    long visible = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) {
            bool seen = false;
            for (int c = 0; c < 3; ++c) {
                sum += std::abs(at(a, x, y, c) - at(b, x, y, c));
                int apart = 0;
                const int left = std::clamp(x - 1, 0, a.width - 3), top = std::clamp(y - 1, 0, a.height - 3);
                for (int v = top; v < top + 3; ++v)
                    for (int u = left; u < left + 3; ++u) apart += at(a, u, v, c) - at(b, u, v, c);
                seen = seen || std::abs(apart) > 9 * ImageDifference::kVisible;
            }
            visible += seen;
        }
    const double pixels = double(a.width) * a.height;
    return {sum / (3 * pixels), double(visible) / pixels};
}

}  // namespace touchstone::test
