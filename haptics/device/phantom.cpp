#include "haptics/device/phantom.hpp"

#include "haptics/device/phantom_link.hpp"

namespace touchstone {
namespace {

/// The device in its own axes, with wrenches about the origin of the stylus.
class PhantomDevice final : public Device {
  public:
    explicit PhantomDevice(std::shared_ptr<PhantomLink> link) : link_(std::move(link)) {}
    DeviceReading read(double, double) noexcept override {
        PhantomLink::Sample sample;
        const bool valid = link_->newest(sample);
        return {.X_WT_device = sample.X_DS, .valid = valid, .fault = link_->faulty(), .buttons = sample.buttons};
    }
    void write(const Wrench& wrench) noexcept override { link_->command(wrench); }
    void releaseForces() noexcept override { link_->disarm(); }
    void engage(const Pose&) noexcept override { link_->arm(); }
    DeviceLimits limits() const noexcept override { return link_->limits(); }
    bool drive(double rate, const std::function<bool()>& tick) noexcept override { return link_->drive(rate, tick); }
    std::shared_ptr<DeviceControl> control() const override { return link_; }

  private:
    const std::shared_ptr<PhantomLink> link_;
};

}  // namespace

std::unique_ptr<Device> makePhantom(const DeviceContext& context) {
    return makeMapped(std::make_unique<PhantomDevice>(PhantomLink::connect(context.file)), context.X_WT_start);
}

DeviceCheck examinePhantom() { return PhantomLink::examine(); }

}  // namespace touchstone
