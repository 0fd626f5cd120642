#pragma once
// Text in memory, read line by line and word by word.
#include <cstdint>
#include <optional>
#include <string_view>

namespace touchstone::engine {

/// Lines end with LF, CR LF or CR alone; words are separated by blanks. Independent of the locale.
class TextCursor {
  public:
    /// Goes over a byte order mark.
    explicit TextCursor(std::string_view text) : text_(text), next_(text.starts_with("\xEF\xBB\xBF") ? 3 : 0) {}

    /// Goes to the next line; false at the end of the text.
    bool nextLine();
    /// Of the line read, counted from 1; 0 before the first.
    std::uint64_t line() const { return line_; }
    /// The next word of the line; empty at its end.
    std::string_view word();
    /// The next word of this line or of a later one; empty at the end of the text.
    std::string_view nextWord();
    /// Nothing but blanks is left of the line.
    bool atLineEnd();
    /// All of the line that has not been read, without blanks around it.
    std::string_view rest();
    /// Where the next line begins, in bytes.
    std::size_t nextOffset() const { return next_; }

  private:
    std::string_view text_;
    std::size_t at_ = 0, end_ = 0, next_;  // in the line, its end, the next one
    std::uint64_t line_ = 0;
};

/// The number that the whole word writes; none if it writes none. A leading plus sign is allowed, a decimal comma not.
/// Infinities and NaN are numbers here.
std::optional<double> numberIn(std::string_view word);

/// The same for a whole number; none if it does not fit.
std::optional<std::int64_t> integerIn(std::string_view word);

}  // namespace touchstone::engine
