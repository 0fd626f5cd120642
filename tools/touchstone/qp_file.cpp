#include "tools/touchstone/qp_file.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

namespace touchstone::app {
namespace {

using nlohmann::json;

/// A malformed line.
struct Broken : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Puts quotes around bare NaN and Infinity, in any case, with a sign or without.
std::string withQuotedWords(const std::string& text) {
    std::string out;
    bool inString = false;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (inString && c == '\\') {
            out += text.substr(i, 2);
            i += 2;
            continue;
        }
        if (c == '"') inString = !inString;
        const bool word = !inString && std::isalpha(static_cast<unsigned char>(c)) &&
                          (i == 0 || !(std::isdigit(static_cast<unsigned char>(text[i - 1])) || text[i - 1] == '.'));
        if (!word) {
            out += c;
            ++i;
            continue;
        }
        std::string lower;
        const std::size_t start = i;
        for (; i < text.size() && std::isalpha(static_cast<unsigned char>(text[i])); ++i)
            lower += static_cast<char>(std::tolower(static_cast<unsigned char>(text[i])));
        const bool nan = lower == "nan", infinite = lower == "inf" || lower == "infinity";
        if (!nan && !infinite) {
            out += text.substr(start, i - start);
            continue;
        }
        std::string sign;
        if (!out.empty() && (out.back() == '-' || out.back() == '+')) {
            if (out.back() == '-' && infinite) sign = "-";
            out.pop_back();
        }
        out += "\"" + sign + (nan ? "NaN" : "Infinity") + "\"";
    }
    return out;
}

class Reader {
  public:
    explicit Reader(const json& line) : line_(line) {}

    void read(QpLine& to) {
        to = {};
        to.G = six(array("G"), "G");
        to.h = six(array("h"), "h");
        for (const json& row : array("J")) to.J.push_back(six(row, "J[" + std::to_string(to.J.size()) + "]"));
        for (const json& gap : array("g")) to.g.push_back(number(gap, "g[" + std::to_string(to.g.size()) + "]"));
        requireAsMany("g", to.g.size(), to.J.size());
        if (!line_.contains("ids")) return;
        for (const json& id : array("ids")) to.ids.push_back(identity(id, to.ids.size()));
        requireAsMany("ids", to.ids.size(), to.J.size());
    }
    /// Where the first NaN or infinity is, in one sentence; empty if there is none.
    const std::string& notFinite() const { return notFinite_; }

  private:
    const json& array(const char* key) const {
        const auto found = line_.find(key);
        if (found == line_.end()) throw Broken(std::string("'") + key + "' is missing");
        if (!found->is_array()) throw Broken(std::string(key) + " must be a list of numbers");
        return *found;
    }
    double number(const json& value, const std::string& where) {
        if (value.is_number()) return value.get<double>();
        const std::string word = value.is_string() ? value.get<std::string>() : "";
        if (word != "NaN" && word != "Infinity" && word != "-Infinity") throw Broken(where + " must be a number");
        if (notFinite_.empty()) notFinite_ = where + " is " + word + ": every entry must be a finite number";
        return 0;
    }
    Vec6 six(const json& values, const std::string& where) {
        if (!values.is_array() || values.size() != 6)
            throw Broken(where + " must be a list of six numbers" +
                         (values.is_array() ? ", not " + std::to_string(values.size()) : ""));
        Vec6 v;
        for (int k = 0; k < 6; ++k) v[k] = number(values[k], where + "[" + std::to_string(k) + "]");
        return v;
    }
    static std::uint64_t identity(const json& value, std::size_t i) {
        if (value.is_number_unsigned()) return value.get<std::uint64_t>();
        if (value.is_number_integer()) return static_cast<std::uint64_t>(value.get<std::int64_t>());
        throw Broken("ids[" + std::to_string(i) + "] must be a 64-bit integer");
    }
    static void requireAsMany(const char* key, std::size_t n, std::size_t rows) {
        if (n != rows)
            throw Broken(std::string(key) + " has " + std::to_string(n) + " entries, but J has " +
                         std::to_string(rows) + " rows");
    }

    const json& line_;
    std::string notFinite_;
};

/// JSON of numbers that read back to the same bits.
class Writer {
  public:
    template <class Number>
    void number(Number value) {
        comma();
        char buffer[32];
        if (std::isfinite(static_cast<double>(value)))
            text_.append(buffer, std::to_chars(buffer, std::end(buffer), value).ptr);
        else
            text_ += "null";
        fresh_ = false;
    }
    void open(char bracket) {
        comma();
        text_ += bracket;
        fresh_ = true;
    }
    void close(char bracket) {
        text_ += bracket;
        fresh_ = false;
    }
    void key(const char* name) {
        comma();
        text_ += std::string("\"") + name + "\":";
        fresh_ = true;
    }
    template <class Values>
    void list(const char* name, const Values& values) {
        key(name);
        list(values);
    }
    template <class Values>
    void list(const Values& values) {
        open('[');
        for (const auto& value : values) number(value);
        close(']');
    }
    void word(const char* name, const std::string& value) {
        key(name);
        text_ += json(value).dump();
        fresh_ = false;
    }
    void value(const char* name, auto value) {
        key(name);
        number(value);
    }
    std::string take() { return std::move(text_); }

  private:
    void comma() {
        if (!fresh_) text_ += ',';
    }
    std::string text_;
    bool fresh_ = true;
};

}  // namespace

QpFault readQpLine(const std::string& text, QpLine& line) {
    try {
        const json parsed = json::parse(withQuotedWords(text));
        if (!parsed.is_object()) return {"a line must be a JSON object with G, J, g and h", true};
        Reader reader(parsed);
        reader.read(line);
        if (!reader.notFinite().empty()) return {reader.notFinite(), false};
        for (int k = 0; k < 6; ++k)
            if (!(line.G[k] > 0)) return {"G[" + std::to_string(k) + "] must be above zero", false};
        return {};
    } catch (const Broken& broken) {
        return {broken.what(), true};
    } catch (const json::out_of_range&) {
        return {"a number is too large: every entry must be a finite number", false};
    } catch (const json::exception&) {
        return {"this is not JSON: write one object per line, like {\"G\":[…],\"J\":[[…]],\"g\":[…],\"h\":[…]}", true};
    }
}

bool nextLine(std::istream& in, std::string& text, int& number) {
    while (std::getline(in, text)) {
        ++number;
        if (text.find_first_not_of(" \t\r") != std::string::npos) return true;
    }
    return false;
}

std::string toLine(const QpProblem& problem, const SolveResult& result) {
    const RowSet& rows = *problem.rows;
    const auto m = static_cast<std::size_t>(rows.size());
    Writer out;
    out.open('{');
    out.list("G", problem.stiffness);
    out.key("J");
    out.open('[');
    for (int i = 0; i < rows.size(); ++i) out.list(rows.row(i));
    out.close(']');
    out.list("g", std::span(rows.gap(), m));
    out.list("h", problem.wanted);
    out.key("ids");
    out.open('[');
    for (int i = 0; i < rows.size(); ++i) out.number(rows.id(i));
    out.close(']');
    out.list("x", result.x);
    out.close('}');
    return out.take();
}

std::string toLine(const QpAnswer& answer) {
    Writer out;
    out.open('{');
    out.word("status", answer.status);
    out.list("x", answer.x);
    out.list("y", answer.y);
    out.value("iterations", answer.iterations);
    out.value("us", answer.us);
    out.key("kkt");
    out.open('{');
    out.value("primal_mm", answer.kkt.primal_mm);
    out.value("dual_N", answer.kkt.dual_N);
    out.value("stationarity_N", answer.kkt.stationarity_N);
    out.value("complementarity_mJ", answer.kkt.complementarity_mJ);
    out.close('}');
    if (!answer.why.empty()) out.word("why", answer.why);
    out.close('}');
    return out.take();
}

}  // namespace touchstone::app
