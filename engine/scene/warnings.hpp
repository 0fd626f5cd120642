#pragma once
// What was left out of a file, gathered so that a fault of a thousand objects is one sentence.
#include <map>
#include <string>
#include <vector>

namespace touchstone::engine {

/// Collects sentences `object: what.`; objects with the same fault share a sentence that names the first three. At most
/// 100 sentences are kept, and one that counts the rest.
class Warnings {
  public:
    /// `object`: as objectLabel() gives it; `what`: without the full stop.
    void add(const std::string& object, const std::string& what);
    std::vector<std::string> sentences() const;

  private:
    struct Group {
        std::string objects, what;
        std::size_t count = 0;
    };
    std::vector<Group> groups_;
    std::map<std::string, std::size_t> byWhat_;  // into groups_
    std::size_t unnamed_ = 0;
};

}  // namespace touchstone::engine
