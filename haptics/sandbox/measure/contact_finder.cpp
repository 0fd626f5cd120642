#include "haptics/sandbox/measure/contact_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace touchstone::sandbox {
namespace {

constexpr int kRows = 1 << 15;
constexpr int kMany = 1 << 13;         // rows above which the margin shrinks: solving for more takes over a millisecond
constexpr double kCellsPerReach = 30;  // contacts within a cell of this size look like one

}  // namespace

ContactFinder::ContactFinder(std::shared_ptr<const World> world)
    : world_(std::move(world)),
      reach_(world_->reach()),
      rows_(kRows),
      solver_(solverTable()[kExactSolver].make(kRows)) {
    int index = 0;
    for (const Obstacle& obstacle : world_->obstacles) lists_.emplace_back(*world_->tool, *obstacle.tree, index++);
    for (const Obstacle& obstacle : world_->obstacles) X_WO_.push_back(obstacle.X_WO);
}

void ContactFinder::collect(const TickRecord& record, double margin) {
    rows_.clear();
    for (std::size_t i = 0; i < lists_.size(); ++i) {
        const Pose& X_WO = X_WO_[i];
        const Pose X_OT = X_WO.inverse() * record.X_WT;
        lists_[i].forget();
        if (!lists_[i].complete({X_OT, margin}, 0)) continue;  // the overlap is deeper than any picture could show
        if (!lists_[i].appendRows(X_OT, X_WO.R(), margin, rows_))
            lists_[i].appendNearestRows(X_OT, X_WO.R(), margin, rows_);
    }
}

std::span<const NearPair> ContactFinder::pairs(const TickRecord& record, double margin) {
    collect(record, margin);
    pairs_.clear();
    for (int i = 0; i < rows_.size(); ++i) {
        const std::uint64_t id = rows_.id(i);
        pairs_.push_back({obstacleOf(id), toolLeafOf(id), obstacleLeafOf(id), rows_.gap()[i]});
    }
    return pairs_;
}

std::span<const ContactPoint> ContactFinder::find(const TickRecord& record, const Settings& settings, double margin,
                                                  int most) {
    if (record.tick != std::exchange(tick_, record.tick)) {  // the picture of one tick must not change
        if (found_ > kMany) marginShare_ /= 2;
        if (found_ < kMany / 4) marginShare_ = std::min(2 * marginShare_, 1.0);
    }
    collect(record, marginShare_ * margin);
    found_ = rows_.size();
    contacts_.clear();
    for (int i = 0; i < rows_.size(); ++i) {
        const Sphere leaf = world_->tool->leaf(toolLeafOf(rows_.id(i)));
        const Vec3 n = rows_.row(i).head<3>();
        const Vec3 center = record.X_WT * Vec3(leaf.x, leaf.y, leaf.z);
        contacts_.push_back({.p_W = center - double(leaf.r) * n, .n_W = n, .gap = rows_.gap()[i]});
    }
    if (!contacts_.empty()) {
        // The tick's own problem, at the pose where the tool came to rest: its multipliers are the contact forces.
        const Vec3 p_TC = world_->p_TC();
        QpProblem problem;
        problem.stiffness << Vec3::Constant(settings.stiffness), Vec3::Constant(settings.torsion);
        problem.wanted << record.X_WT_device * p_TC - record.X_WT * p_TC,
            logRotation(record.X_WT_device.q * record.X_WT.q.conjugate());
        problem.rows = &rows_;
        solver_->reset();  // without a warm start the result depends on the tick only
        for (const Multiplier& m : solver_->solve(problem, {}).multipliers) contacts_[m.row].load = m.value;
    }
    thin(most);
    return contacts_;
}

void ContactFinder::thin(int most) {
    const double cell = std::max(reach_ / kCellsPerReach, 1e-3);
    const auto cellOf = [&](const ContactPoint& c) {
        std::uint64_t key = 0;
        for (const double x : c.p_W) key = key << 21 | (static_cast<std::int64_t>(std::floor(x / cell)) & 0x1fffff);
        return key;
    };
    const auto isBefore = [](const ContactPoint& a, const ContactPoint& b) {
        return a.load != b.load ? a.load > b.load : a.gap < b.gap;
    };
    cells_.clear();
    for (const ContactPoint& contact : contacts_) cells_.emplace_back(cellOf(contact), static_cast<int>(cells_.size()));
    std::sort(cells_.begin(), cells_.end(), [&](const auto& a, const auto& b) {
        if (a.first != b.first) return a.first < b.first;
        const ContactPoint &x = contacts_[a.second], &y = contacts_[b.second];
        return isBefore(x, y) || (!isBefore(y, x) && a.second < b.second);
    });
    std::vector<ContactPoint> kept;
    for (std::size_t i = 0; i < cells_.size(); ++i)
        if (const ContactPoint& contact = contacts_[cells_[i].second];
            contact.load != 0 || i == 0 || cells_[i].first != cells_[i - 1].first)
            kept.push_back(contact);
    std::stable_sort(kept.begin(), kept.end(), isBefore);
    if (kept.size() > static_cast<std::size_t>(most)) kept.resize(static_cast<std::size_t>(most));
    contacts_ = std::move(kept);
}

}  // namespace touchstone::sandbox
