#pragma once
// The schema of a tick: every number that a recording, a CSV table, a plot or a page of docs shows is declared here
// once, with its name, its unit and one line of explanation.
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

using FieldRef = std::variant<double*, int*, std::uint32_t*, std::uint64_t*, bool*, SolveStatus*>;

/// A field that recordings store.
struct TickField {
    const char* name;                    ///< with its unit; the name of the column
    FieldRef (*of)(RecordedTick& tick);  ///< for reading and writing
    bool repeats;                        ///< a replay of the recorded input gives the same bits
    const char* help;                    ///< one line

    /// The type in NumPy's notation, e.g. <f8. A status is stored as a number.
    const char* type() const;
    /// Bytes in a recording.
    std::size_t size() const;
};

/// In the order of a recording's columns: the input of step(), then its record.
std::span<const TickField> tickFields();
/// The fields of TickRecord only.
std::span<const TickField> recordFields();
/// Bytes of a row.
std::size_t tickRowBytes();

/// What derived fields are computed from.
struct TickSample {
    const RecordedTick& tick;
    const RecordedTick& before;                                     ///< the tick before; of the first tick, itself
    double penetration = std::numeric_limits<double>::quiet_NaN();  ///< of the true gaps, mm, where it was measured
};

/// A number that tables and plots show and recordings do not store.
struct DerivedField {
    const char* name;  ///< with its unit
    double (*of)(const TickSample& sample);
    const char* help;  ///< one line
};
std::span<const DerivedField> derivedFields();

/// A field of either table, found by its name, as a number.
class NumericField {
  public:
    /// Throws std::invalid_argument where neither table has the name: the caller is wrong, not the user.
    explicit NumericField(std::string_view name);

    const char* name() const { return stored_ ? stored_->name : derived_->name; }
    double of(const TickSample& sample) const;

  private:
    const TickField* stored_ = nullptr;
    const DerivedField* derived_ = nullptr;  // where stored_ is null
};

/// All fields, little endian, without padding. Pre: `row` has room for tickRowBytes().
void packTick(const RecordedTick& tick, char* row);

/// True if all fields that repeat have the same bits.
bool sameBits(const RecordedTick& a, const RecordedTick& b);

/// Appends the field as text: numbers read back to the same bits, a status is a word.
void appendField(std::string& line, const TickField& field, const RecordedTick& tick);

/// Two Markdown tables, for the docs: the stored fields with their NumPy types (without the byte order), then the
/// derived ones.
std::string fieldsAsMarkdown();

}  // namespace touchstone::sandbox
