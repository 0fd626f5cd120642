// Names for the columns `flags` and `status` of a tick, as enumerations of Python.
#include <algorithm>
#include <cctype>

#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

constexpr std::pair<TickFlag, const char*> kFlags[] = {
    {kInfeasible, "infeasible"},
    {kNotDeeper, "not-deeper"},
    {kIterationLimit, "iteration-limit"},
    {kNonFinite, "non-finite"},
    {kRowsTruncated, "rows-truncated"},
    {kListOverflow, "list-overflow"},
    {kCapped, "capped"},
    {kHalved, "halved"},
    {kUnfinished, "unfinished"},
    {kBadInput, "bad-input"},
    {kProjected, "projected"},
    {kPaused, "paused"},
    {kObstacleHeld, "obstacle-held"},
    {kOverlapping, "overlapping"},
    {kFrictionSoft, "friction-soft"},
    {kFrictionHeld, "friction-held"},
    {kByProcessor, "by-processor"},
};
constexpr SolveStatus kStatusValues[] = {SolveStatus::Solved, SolveStatus::Elastic, SolveStatus::IterationLimit,
                                         SolveStatus::Invalid};

/// iteration-limit as Python writes it: ITERATION_LIMIT.
std::string constant(std::string name) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return c == '-' ? '_' : char(std::toupper(c)); });
    return name;
}

void add(py::module_& module, const char* base, const char* name, const py::dict& members, const char* doc) {
    const py::object made = py::module_::import("enum").attr(base)(name, members, py::arg("module") = "touchstone");
    made.attr("__doc__") = doc;
    module.attr(name) = made;
}

}  // namespace

void bindFlags(py::module_& module) {
    py::dict flags, status;
    for (const auto& [flag, name] : kFlags) flags[py::str(constant(name))] = unsigned(flag);
    for (const SolveStatus value : kStatusValues) status[py::str(constant(name(value)))] = int(value);
    add(module, "IntFlag", "Flag", flags,
        R"(What was unusual about a tick: bits of its column `flags`.

INFEASIBLE: the rows contradicted each other. NOT_DEEPER: ... and the answer that deepens no overlap was used.
ITERATION_LIMIT: a work limit ended a solve. NON_FINITE, LIST_OVERFLOW, BAD_INPUT: tool held, no force; for a result that
is not finite, for want of memory, for an invalid pose. ROWS_TRUNCATED: more pairs than rows. CAPPED, HALVED: a move was
shortened. UNFINISHED: the next tick goes on. PROJECTED: an approximate answer was projected onto the rows. PAUSED: by the
setting `pause`. OBSTACLE_HELD: an obstacle waits for the tool. OVERLAPPING: meshes overlap, as at the start, and the tool
passes through what it is in until it is out. FRICTION_SOFT: contacts gave way by up to 0.3 µm.
FRICTION_HELD: no forces with friction were found, tool and force stay. BY_PROCESSOR: the solver's card was late or lost.)");
    add(module, "IntEnum", "Status", status,
        "How a solver ended: values of a tick's columns `status` and `shadow_status`.");
}

}  // namespace touchstone::python
