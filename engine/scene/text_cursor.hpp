#pragma once
// Reads text in memory line by line and word by word.
#include <cstdint>
#include <optional>
#include <string_view>

namespace touchstone::engine {

/// Lines end with LF, CR LF or CR alone; words are separated by blanks. Independent of the locale.
class TextCursor {
  public:
    /// Skips a byte order mark.
    explicit TextCursor(std::string_view text) : text_(text), next_(text.starts_with("\xEF\xBB\xBF") ? 3 : 0) {}

    /// Goes to the next line; false at the end of the text.
    bool nextLine();
    /// Number of the current line from 1; 0 before the first.
    std::uint64_t line() const { return line_; }
    /// The next word of the line; empty at its end.
    std::string_view word();
    /// The next word of this line or of a later one; empty at the end of the text.
    std::string_view nextWord();
    /// Whether the rest of the line is blank. Skips the blanks.
    bool atLineEnd();
    /// The unread rest of the line, without leading and trailing blanks.
    std::string_view rest();
    /// Byte offset of the next line.
    std::size_t nextOffset() const { return next_; }

  private:
    std::string_view text_;
    std::size_t at_ = 0, end_ = 0, next_;  // offsets of the cursor, the end of its line and the next line
    std::uint64_t line_ = 0;
};

/// Parses the whole word as a number; nothing if that fails. A leading plus sign is allowed, a decimal comma is not.
/// Infinity and NaN are accepted.
std::optional<double> numberIn(std::string_view word);

/// What one in the last digit of a number is worth: 0.01 in "-3.20" and "320e-4". Pre: numberIn() accepts the word.
double lastDigitOf(std::string_view word);

/// The same as numberIn() for a whole number; nothing if it does not fit.
std::optional<std::int64_t> integerIn(std::string_view word);

}  // namespace touchstone::engine
