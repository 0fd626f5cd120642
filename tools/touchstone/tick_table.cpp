#include "tools/touchstone/tick_table.hpp"

#include <charconv>
#include <iterator>
#include <string>

#include "haptics/system/tick_fields.hpp"

namespace touchstone::app {
namespace {

/// What is not of the record, behind the tick's number.
constexpr const char* kOthers = ",t_ms,penetration_mm,step_us";

std::string text(double number) {
    char buffer[32];
    return {buffer, std::to_chars(buffer, std::end(buffer), number).ptr};
}

}  // namespace

TickTable::TickTable(const std::filesystem::path& file) : out_(file, "the ticks") {
    std::string header;
    for (const system::TickField& field : system::recordFields())
        header += header.empty() ? field.name + std::string(kOthers) : ',' + std::string(field.name);
    out_.write(header + '\n');
}

void TickTable::add(const TickRecord& record, double penetration, double rate) {
    const WholeTick tick{.input = {}, .record = record};
    std::string line;
    for (const system::TickField& field : system::recordFields()) {
        if (!line.empty()) line += ',';
        const bool first = line.empty();
        appendField(line, field, tick);
        if (first)
            line += ',' + text(static_cast<double>(record.tick) * 1000 / rate) + ',' + text(penetration) + ',' +
                    text(record.totalUs - record.shadowUs);
    }
    out_.write(line + '\n');
}

}  // namespace touchstone::app
