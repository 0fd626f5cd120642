// Presses a ball of 10 mm radius 2 mm into another with the installed library: the graphic tool stays outside, and the
// force is k_t times the penetration of the device.
#include <cmath>
#include <cstdio>
#include <haptics/loop/step.hpp>
#include <memory>

int main() {
    using namespace touchstone;
    const auto ball = std::make_shared<const SphereTree>(makeSphereTree({{0, 0, 0, 10}}));
    const World world{ball, {{"ball", ball, {}}}, {Vec3(0, 25, 0), Quat::Identity()}};
    StepState state(world);
    TickRecord record;
    for (int tick = 0; tick < 100; ++tick) {
        const double y = std::fmax(18, 25 - 0.1 * tick);
        record = step(world, Settings{}, {{Vec3(0, y, 0), Quat::Identity()}}, state);
    }
    std::printf("tool at %.6f mm, force %.6f N\n", record.X_WT.p.y(), record.wrench_C.force.y());
    return std::fabs(record.X_WT.p.y() - 20) < 1e-3 && std::fabs(record.wrench_C.force.y() - 2) < 1e-3 ? 0 : 1;
}
