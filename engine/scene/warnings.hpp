#pragma once
// Collects warnings about a file, so that a problem of a thousand objects gives one sentence.
#include <map>
#include <string>
#include <vector>

namespace touchstone::engine {

/// Collects sentences `object: what.` Objects with the same problem share a sentence that names the first three. At
/// most 100 sentences are kept, plus one that counts the rest.
class Warnings {
  public:
    /// `object`: from objectLabel(); `what`: without the period.
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
