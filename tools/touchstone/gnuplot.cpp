#include "tools/touchstone/gnuplot.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace touchstone::app {
namespace {

constexpr const char* kStyle = R"(grey = "#808890"
set border 3 linecolor rgb grey
set tics nomirror textcolor rgb grey
set xlabel textcolor rgb grey
set ylabel textcolor rgb grey
set title textcolor rgb grey
set key textcolor rgb grey spacing 1.1 noenhanced
set grid linecolor rgb grey linewidth 0.3
)";
constexpr const char* kColours[] = {"#2f81f7", "#e07020", "#1f9d55", "#c03060", "#8a5cd0",
                                    "#b08800", "#20a0a0", "#606870", "#d05090"};

/// It ends as its format ends: gnuplot does not tell when a disk is full.
bool isWhole(const std::filesystem::path& picture) {
    std::ifstream in(picture, std::ios::binary);
    in.seekg(-12, std::ios::end);
    const std::string end(std::istreambuf_iterator<char>(in), {});
    return end.find("</svg>") != std::string::npos || end.find("IEND") != std::string::npos;
}

}  // namespace

std::string colour(std::size_t i) { return kColours[i % std::size(kColours)]; }
std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

void requireGnuplot() {
    if (std::system("command -v gnuplot >/dev/null 2>&1") != 0)
        throw std::runtime_error(
            "the plots need gnuplot, which is not there: install gnuplot-nox (`bench` and `trials` draw none with "
            "--shard 1/1)");
}

void gnuplot(const std::filesystem::path& folder, const std::string& name, const std::string& commands, int height) {
    std::string id = name;  // gnuplot allows no more than letters, digits and _
    std::replace(id.begin(), id.end(), '-', '_');
    const std::string size = " size 960," + std::to_string(height);
    for (const auto& [terminal, extension] :
         {std::pair{"svg" + size + " dynamic font \"sans-serif,13\" name \"" + id + "\"", ".svg"},
          std::pair{"pngcairo" + size + " font \"sans-serif,10\"", ".png"}}) {
        FILE* pipe = popen("gnuplot", "w");
        if (!pipe) throw std::runtime_error("gnuplot could not be started, although it is installed");
        const std::filesystem::path file = folder / (name + extension), part = file.string() + ".part";
        const std::string script =
            "set terminal " + terminal + "\nset output \"" + part.string() + "\"\n" + kStyle + commands;
        std::fwrite(script.data(), 1, script.size(), pipe);
        const bool drawn = pclose(pipe) == 0 && isWhole(part);
        std::error_code error;
        if (drawn) std::filesystem::rename(part, file, error);
        if (drawn && !error) continue;
        std::filesystem::remove(part, error);
        throw std::runtime_error("gnuplot could not draw '" + file.string() +
                                 "': see its message above, and check the folder and the free space");
    }
}

void Lines::add(const std::string& title, const Points& points, const std::string& style,
                const std::string& colourName) {
    if (points.empty()) return;
    const std::string name = "$d" + std::to_string(count_);
    data_ += name + " << EOD\n";
    for (const auto& [x, y] : points) data_ += text(x) + " " + text(y) + "\n";
    data_ += "EOD\n";
    plot_ += (plot_.empty() ? "plot " : ", ") + name + " with " + style + " linewidth 2 linecolor rgb \"" +
             (colourName.empty() ? colour(count_) : colourName) + "\" title \"" + title + "\"";
    ++count_;
}

std::string bars(const std::vector<std::pair<std::string, std::vector<double>>>& groups,
                 const std::vector<std::string>& names) {
    std::string body = "$d << EOD\n";
    for (const auto& [label, values] : groups) {
        body += '"' + label + '"';
        for (const double value : values) body += " " + text(value);
        body += "\n";
    }
    body +=
        "EOD\nset style data histograms\nset style histogram clustered gap 1"
        "\nset style fill solid 0.9\nset boxwidth 0.8\nset rmargin 8\nset xtics rotate by -50 font \",10\" "
        "noenhanced\nplot ";
    for (std::size_t i = 0; i < names.size(); ++i)
        body += std::string(i ? ", " : "") + "$d using " + std::to_string(i + 2) + ":xtic(1) linecolor rgb \"" +
                colour(i) + "\" title \"" + names[i] + "\"";
    return body + "\n";
}

}  // namespace touchstone::app
