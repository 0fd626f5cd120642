#include "engine/scene/warnings.hpp"

namespace touchstone::engine {
namespace {
constexpr std::size_t kMaxSentences = 100, kMaxNames = 3;
}

void Warnings::add(const std::string& object, const std::string& what) {
    auto found = byWhat_.find(what);
    if (found == byWhat_.end()) {
        if (groups_.size() == kMaxSentences) {
            ++unnamed_;
            return;
        }
        found = byWhat_.emplace(what, groups_.size()).first;
        groups_.push_back({{}, what});
    }
    Group& group = groups_[found->second];
    if (++group.count <= kMaxNames) group.objects += (group.count == 1 ? "" : ", ") + object;
}

std::vector<std::string> Warnings::sentences() const {
    std::vector<std::string> all;
    for (const Group& group : groups_) {
        const std::string more =
            group.count > kMaxNames ? " and " + std::to_string(group.count - kMaxNames) + " more" : "";
        all.push_back(group.objects + more + ": " + group.what + ".");
    }
    if (unnamed_ > 0) all.push_back(std::to_string(unnamed_) + " more problems of this file are not listed.");
    return all;
}

}  // namespace touchstone::engine
