#include "tools/touchstone/tick_table.hpp"

#include <array>
#include <charconv>
#include <iterator>
#include <string>

#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::app {
namespace {

std::string shortest(double number) {
    char buffer[32];
    return {buffer, std::to_chars(buffer, std::end(buffer), number).ptr};
}

/// They follow the tick's number.
const auto& derivedColumns() {
    static const std::array columns{sandbox::NumericField("t_ms"), sandbox::NumericField("penetration_mm"),
                                    sandbox::NumericField("step_us")};
    return columns;
}

}  // namespace

TickTable::TickTable(const std::filesystem::path& file) : out_(file, "the ticks") {
    std::string header;
    for (const sandbox::TickField& field : sandbox::recordFields()) {
        const bool first = header.empty();
        header += (first ? "" : ",") + std::string(field.name);
        if (first)
            for (const sandbox::NumericField& column : derivedColumns()) header += ',' + std::string(column.name());
    }
    out_.write(header + '\n');
}

void TickTable::add(const TickRecord& record, double penetration, double rate) {
    RecordedTick tick;
    tick.record = record;
    tick.settings.rate = rate;
    std::string line;
    for (const sandbox::TickField& field : sandbox::recordFields()) {
        const bool first = line.empty();
        if (!first) line += ',';
        appendField(line, field, tick);
        if (first)
            for (const sandbox::NumericField& column : derivedColumns())
                line += ',' + shortest(column.of({tick, tick, penetration}));
    }
    out_.write(line + '\n');
}

}  // namespace touchstone::app
