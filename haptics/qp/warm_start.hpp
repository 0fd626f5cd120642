#pragma once
// What a solver remembers of its last answer, so that the next solve starts near the new one.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "haptics/qp/problem.hpp"

namespace touchstone {

/// The contacts of the last answer with their forces, by identity, since rows change places from tick to tick. Real
/// time: the constructor takes all memory; no function allocates, locks or throws.
class WarmStart {
  public:
    /// `capacity`: the maximum number of contacts that an answer can have.
    explicit WarmStart(int capacity) : ids_(std::size_t(capacity)), forces_(std::size_t(capacity)) {}

    void forget() { size_ = 0; }
    /// Adds a contact to those since the last forget(). Pre: fewer than the capacity.
    void remember(std::uint64_t id, double force) {
        ids_[std::size_t(size_)] = id;
        forces_[std::size_t(size_)] = force;
        ++size_;
    }

    /// Calls visit(row) for every remembered contact that has a row in this problem, in the order in which the contacts
    /// were remembered, until it returns false. For few contacts among many rows: O(contacts log rows).
    template <class Visit>
    void forEachRow(const RowSet& rows, Visit&& visit) const {
        for (int k = 0; k < size_; ++k) {
            const int row = rows.find(ids_[std::size_t(k)]);
            if (row >= 0 && !visit(row)) return;
        }
    }

    /// Looks up the forces of many contacts in one pass: O(contacts + look-ups).
    class ForceLookup {
      public:
        explicit ForceLookup(const WarmStart& from) : from_(from) {}
        /// The remembered force, or `otherwise` for a new contact. Identities must ascend, both those remembered and
        /// those asked for; where they do not, a contact may be taken for a new one, which is a colder start to the
        /// same answer.
        double forceOf(std::uint64_t id, double otherwise) {
            while (next_ < from_.size_ && from_.ids_[std::size_t(next_)] < id) ++next_;
            const bool known = next_ < from_.size_ && from_.ids_[std::size_t(next_)] == id;
            return known ? from_.forces_[std::size_t(next_)] : otherwise;
        }

      private:
        const WarmStart& from_;
        int next_ = 0;
    };

  private:
    int size_ = 0;
    AlignedVector<std::uint64_t> ids_;
    AlignedVector<double> forces_;  ///< N on unit rows
};

}  // namespace touchstone
