#pragma once
// Every field of a recorded tick by name: the one table for recordings, CSV and the docs.
#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

using FieldRef = std::variant<double*, int*, std::uint32_t*, std::uint64_t*, bool*, SolveStatus*>;

struct TickField {
    const char* name;                    ///< with its unit, as a column
    FieldRef (*of)(RecordedTick& tick);  ///< to read and to write
    bool repeats;                        ///< the same bits when the tick is repeated from its input
    const char* help;                    ///< one line

    /// NumPy's name of the type, e.g. <f8; names are numbers.
    const char* type() const;
    /// Bytes in a recording.
    std::size_t size() const;
};

/// In the order of a recording's columns: what step() received, then the tick.
std::span<const TickField> tickFields();
/// Those of TickRecord, behind what step() received.
std::span<const TickField> recordFields();
/// Bytes of a row.
std::size_t tickRowBytes();

/// All fields, little endian, one after another. Pre: `row` has room for tickRowBytes().
void packTick(const RecordedTick& tick, char* row);

/// Whether all fields that repeat have the same bits.
bool sameBits(const RecordedTick& a, const RecordedTick& b);

/// The field as text: numbers read back to the same bits, the solver's status is a word.
void appendField(std::string& line, const TickField& field, const RecordedTick& tick);

/// Name, NumPy type without its byte order, and meaning of every field as a Markdown table.
std::string fieldsAsMarkdown();

}  // namespace touchstone::sandbox
