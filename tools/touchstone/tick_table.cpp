#include "tools/touchstone/tick_table.hpp"

#include <charconv>
#include <iterator>
#include <string>

#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::app {
namespace {

/// What is not of the record, behind the tick's number.
constexpr const char* kOthers = ",t_ms,penetration_mm,step_us";

std::string shortest(double number) {
    char buffer[32];
    return {buffer, std::to_chars(buffer, std::end(buffer), number).ptr};
}

}  // namespace

TickTable::TickTable(const std::filesystem::path& file) : out_(file, "the ticks") {
    std::string header;
    for (const sandbox::TickField& field : sandbox::recordFields())
        header += header.empty() ? field.name + std::string(kOthers) : ',' + std::string(field.name);
    out_.write(header + '\n');
}

void TickTable::add(const TickRecord& record, double penetration, double rate) {
    const RecordedTick tick{.input = {}, .record = record};
    std::string line;
    for (const sandbox::TickField& field : sandbox::recordFields()) {
        if (!line.empty()) line += ',';
        const bool first = line.empty();
        appendField(line, field, tick);
        if (first)
            line += ',' + shortest(static_cast<double>(record.tick) * 1000 / rate) + ',' + shortest(penetration) + ',' +
                    shortest(record.totalUs - record.shadowUs);
    }
    out_.write(line + '\n');
}

}  // namespace touchstone::app
