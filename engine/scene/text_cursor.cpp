#include "engine/scene/text_cursor.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace touchstone::engine {
namespace {

constexpr bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

std::string_view withoutPlus(std::string_view word) {
    // from_chars() does not accept a plus sign. Without this check, "+-1" would be accepted.
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    return word;
}

template <class T>
std::from_chars_result parse(std::string_view word, T& value) {
    return std::from_chars(word.data(), word.data() + word.size(), value);
}

}  // namespace

bool TextCursor::nextLine() {
    if (next_ >= text_.size()) return false;
    at_ = end_ = next_;
    while (end_ < text_.size() && text_[end_] != '\n' && text_[end_] != '\r') ++end_;
    next_ = std::min(end_ + (text_.substr(end_, 2) == "\r\n" ? 2 : 1), text_.size());
    ++line_;
    return true;
}

std::string_view TextCursor::word() {
    atLineEnd();  // skips blanks
    const std::size_t begin = at_;
    while (at_ < end_ && !isBlank(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
}

bool TextCursor::atLineEnd() {
    while (at_ < end_ && isBlank(text_[at_])) ++at_;
    return at_ == end_;
}

std::string_view TextCursor::nextWord() {
    for (;;)
        if (const std::string_view found = word(); !found.empty() || !nextLine()) return found;
}

std::string_view TextCursor::rest() {
    atLineEnd();
    std::size_t last = end_;
    while (last > at_ && isBlank(text_[last - 1])) --last;
    const std::string_view found = text_.substr(at_, last - at_);
    at_ = end_;
    return found;
}

std::optional<double> numberIn(std::string_view word) {
    word = withoutPlus(word);
    double value = 0;
    auto [end, error] = parse(word, value);
    if (error == std::errc::result_out_of_range) {
        // from_chars() does not report whether the number is too large or too small for a double.
        long double wide = 0;
        const auto again = parse(word, wide);
        end = again.ptr;
        error = again.ec;
        value = static_cast<double>(wide);
    }
    if (error != std::errc{} || end != word.data() + word.size()) return {};
    return value;
}

double lastDigitOf(std::string_view word) {
    const std::size_t exponent = std::min(word.find_first_of("eE"), word.size());
    const std::size_t point = std::min(word.find('.'), exponent);
    const auto power = exponent < word.size() ? integerIn(word.substr(exponent + 1)).value_or(0) : 0;
    return std::pow(10.0, double(power) - (point < exponent ? double(exponent - point - 1) : 0));
}

std::optional<std::int64_t> integerIn(std::string_view word) {
    word = withoutPlus(word);
    std::int64_t value = 0;
    const auto [end, error] = parse(word, value);
    if (error != std::errc{} || end != word.data() + word.size()) return {};
    return value;
}

}  // namespace touchstone::engine
