// Another program that uses the library: touches two meshes, tick by tick and then in a loop with a device of its own.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>
#include <touchstone/touchstone.hpp>

using namespace touchstone;

/// A box about the origin, mm.
TriangleMesh box(double x, double y, double z) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.vertices.push_back({i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// Where the hand wants the tool at a time in ms: to the side, and down to 2 mm below where it touches.
Pose wanted(double t) { return {Vec3(t / 64, std::max(18.0, 25 - t / 8), 0), Quat::Identity()}; }

/// A device without hardware. Its functions may not wait, allocate, lock or throw.
class MyDevice final : public Device {
  public:
    explicit MyDevice(std::atomic<double>& force) : force_(force) {}
    DeviceReading read(double t, double) noexcept override { return {.X_WT_device = wanted(t), .finished = t > 300}; }
    void write(const Wrench& wrench) noexcept override { force_ = std::max(force_.load(), wrench.force.y()); }
    DeviceLimits limits() const noexcept override { return {.motors = false}; }

  private:
    std::atomic<double>& force_;  // N, the greatest
};

int main() {
    World world;
    world.tool = Part::fromTriangles(box(10, 10, 10));
    world.obstacles.push_back({"table", Part::fromTriangles(box(50, 10, 50))});
    world.X_WT_start = wanted(0);
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < 200; ++tick) record = step(world, Settings(), {wanted(tick)}, state);
    std::printf("tool at %a, %a mm, force %a N\n", record.X_WT.p.x(), record.X_WT.p.y(), record.wrench_C.force.y());
    const bool touches = std::abs(record.X_WT.p.y() - 20) < 0.01 && std::abs(record.wrench_C.force.y() - 2) < 0.01;

    std::atomic<double> force = 0;
    HapticLoop loop(std::make_shared<const World>(world), Settings(), std::make_unique<MyDevice>(force));
    while (!loop.poll() || !loop.snapshot().finished) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return touches && std::abs(force - 2) < 0.01 ? 0 : 1;
}
