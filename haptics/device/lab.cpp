#include "haptics/device/lab.hpp"

#include <stdexcept>

#include "haptics/device/lab_link.hpp"

namespace touchstone {
namespace {

/// The arm in its own axes, with wrenches about the origin of its pose.
class LabDevice final : public Device {
  public:
    explicit LabDevice(std::shared_ptr<LabLink> link) : link_(std::move(link)) {}
    DeviceReading read(double, double) noexcept override { return link_->read(); }
    void write(const Wrench& wrench) noexcept override { link_->write(wrench); }
    void releaseForces() noexcept override { link_->disarm(); }
    void engage(const Pose&) noexcept override { link_->arm(); }
    DeviceLimits limits() const noexcept override { return link_->limits(); }
    std::shared_ptr<DeviceControl> control() const override { return link_; }

  private:
    const std::shared_ptr<LabLink> link_;
};

}  // namespace

std::unique_ptr<Device> makeLab(const DeviceContext& context) {
    return makeMapped(std::make_unique<LabDevice>(LabLink::connect(context.file)), context.X_WT_start);
}

DeviceCheck examineLab() {
    try {
        const std::shared_ptr<LabLink> link = LabLink::connect({});
        return {true, link->status().text};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

}  // namespace touchstone
