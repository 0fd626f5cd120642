#pragma once
// `run --ticks`: every tick of a run as a line of CSV, with the names of record/tick_fields.
#include <filesystem>

#include "haptics/files/output_file.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::app {

class TickTable {
  public:
    /// Throws std::runtime_error if the file cannot be written.
    explicit TickTable(const std::filesystem::path& file);
    /// `penetration`: of the true gaps, mm; `rate`: Hz.
    void add(const TickRecord& record, double penetration, double rate);
    /// Moves the complete file to its place. Throws std::runtime_error if something could not be written.
    void close() { out_.close(); }

  private:
    OutputFile out_;
};

}  // namespace touchstone::app
