// The quadratic program of the tick, and Coulomb friction, for rows of one's own.
#include <pybind11/stl.h>

#include <cmath>

#include "haptics/qp/friction_table.hpp"
#include "haptics/qp/solver.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

struct Answer {
    std::string status;
    int iterations = 0;
    Numbers x, forces;
    py::dict residuals;
};

template <class Table>
const auto& infoOf(const Table& table, const std::string& name) {
    std::string names;
    for (const auto& info : table) {
        if (info.name == name) return info;
        names += (names.empty() ? "" : ", ") + std::string(info.name);
    }
    throw std::invalid_argument("there is no solver '" + name + "': choose one of " + names);
}

template <class Table>
py::dict summaries(const Table& table) {
    py::dict dict;
    for (const auto& info : table) dict[py::str(std::string(info.name))] = std::string(info.summary);
    return dict;
}

Vec6 stiffnessOf(const Numbers& array) {
    const Vec6 stiffness = toVec6(array, "stiffness");
    if (!((stiffness.array() > 0).all() && stiffness.allFinite()))
        throw std::invalid_argument("stiffness must be positive: three N/mm, three mN·m/rad");
    return stiffness;
}

void requireFinite(const Numbers& array, const char* name) {
    for (py::ssize_t i = 0; i < array.size(); ++i)
        if (!std::isfinite(array.data()[i])) throw std::invalid_argument(std::string(name) + " must be finite");
}

/// Whether an answer is one by its residuals: to 1e-6 of the sizes in the problem, beyond what an approximate solver
/// may leave.
bool holds(const QpProblem& problem, const SolveResult& result, double tolerance) {
    double reach = 1;  // mm
    double yield = 0;  // mm a N: a force error of `tolerance` leaves so much of a gap
    for (int i = 0; i < problem.rows->size(); ++i) {
        const Vec6 row = problem.rows->row(i);
        reach = std::max({reach, std::abs(problem.rows->gap()[i]), std::abs(row.dot(problem.wanted))});
        yield = std::max(yield, row.cwiseAbs2().cwiseQuotient(problem.stiffness).sum());
    }
    double force = 1;  // N
    for (const Multiplier& m : result.multipliers) force = std::max(force, m.value);
    return result.kkt.primal_mm <= 1e-6 * reach + tolerance * yield &&
           result.kkt.stationarity_N <= 1e-6 * force + tolerance && result.kkt.dual_N <= 1e-6 * force + tolerance;
}

Answer solveQp(const Numbers& rows, const Numbers& gaps, const Numbers& stiffness, const Numbers& wanted,
               const std::string& solver, double tolerance, int maxIterations, bool paperForm) {
    requireShape(rows, {-1, 6}, "rows");
    const py::ssize_t count = rows.shape(0);
    requireShape(gaps, {count}, "gaps");
    requireFinite(rows, "rows");
    requireFinite(gaps, "gaps");
    requireFinite(wanted, "wanted");
    if (!(tolerance > 0) || maxIterations < 1)
        throw std::invalid_argument("tolerance must be above 0, and max_iterations at least 1");
    const SolverInfo& info = infoOf(solverTable(), solver);
    RowSet set{int(count)};
    for (py::ssize_t i = 0; i < count; ++i)
        set.push(Eigen::Map<const Vec6>(rows.data(i, 0)), gaps.at(i), std::uint64_t(i));
    const QpProblem problem{stiffnessOf(stiffness), toVec6(wanted, "wanted"), &set};
    Answer answer;
    SolveResult result;
    const auto solving = info.make(int(count));
    {
        const py::gil_scoped_release free;
        result =
            solving->solve(problem, {.paperForm = paperForm, .tolerance = tolerance, .maxIterations = maxIterations});
    }
    Numbers forces(count);
    std::fill_n(forces.mutable_data(), count, 0.0);
    for (const Multiplier& m : result.multipliers) forces.mutable_at(m.row) = m.value;
    const bool solved = result.status == SolveStatus::Solved;
    answer.status = solved && !paperForm && !holds(problem, result, info.exact ? 0 : tolerance) ? "inaccurate"
                                                                                                : name(result.status);
    answer.iterations = result.iterations;
    answer.x = toArray(result.x);
    answer.forces = forces;
    answer.residuals["primal_mm"] = result.kkt.primal_mm;
    answer.residuals["dual_N"] = result.kkt.dual_N;
    answer.residuals["stationarity_N"] = result.kkt.stationarity_N;
    answer.residuals["complementarity_mJ"] = result.kkt.complementarity_mJ;
    return answer;
}

Answer solveFriction(const Numbers& normals, const Numbers& arms, const Numbers& gaps, const Numbers& coefficients,
                     const Numbers& stiffness, const Numbers& wanted, const std::string& solver) {
    requireShape(normals, {-1, 3}, "normals");
    const py::ssize_t count = normals.shape(0);
    requireShape(arms, {count, 3}, "arms");
    requireShape(gaps, {count}, "gaps");
    requireShape(coefficients, {count}, "coefficients");
    std::vector<FrictionContact> contacts(static_cast<std::size_t>(count));
    for (py::ssize_t i = 0; i < count; ++i) {
        FrictionContact& contact = contacts[std::size_t(i)];
        contact.id = std::uint64_t(i);
        contact.n = Eigen::Map<const Vec3>(normals.data(i, 0));
        contact.r = Eigen::Map<const Vec3>(arms.data(i, 0));
        contact.gap = gaps.at(i);
        contact.coefficient = coefficients.at(i);
        if (!(std::abs(contact.n.norm() - 1) < 1e-6) || !contact.r.allFinite() || !std::isfinite(contact.gap) ||
            !(contact.coefficient >= 0 && std::isfinite(contact.coefficient)))
            throw std::invalid_argument("contact " + std::to_string(i) +
                                        " needs a normal of length 1, a finite arm and gap, and a coefficient from 0");
    }
    const FrictionProblem problem{stiffnessOf(stiffness), toVec6(wanted, "wanted"), contacts};
    if (!problem.wanted.allFinite()) throw std::invalid_argument("wanted must be finite");
    const auto solving = infoOf(frictionSolverTable(), solver).make(int(count));
    FrictionResult result;
    {
        const py::gil_scoped_release free;
        result = solving->solve(problem, Vec6::Zero());
    }
    static constexpr const char* kStatus[] = {"exact", "regularized", "approximate", "none"};
    const CoulombResiduals residuals = coulombResiduals(problem, result.x, result.forces);
    Answer answer{
        kStatus[std::size_t(result.status)], result.iterations, toArray(result.x), toArray(result.forces), {}};
    answer.residuals["balance_N"] = residuals.balance_N;
    answer.residuals["overlap_mm"] = residuals.overlap_mm;
    answer.residuals["cone_N"] = residuals.cone_N;
    answer.residuals["complementarity_mJ"] = residuals.complementarity_mJ;
    answer.residuals["direction_mJ"] = residuals.direction_mJ;
    return answer;
}

}  // namespace

void bindSolvers(py::module_& module) {
    py::class_<Answer>(module, "Answer", "What solve_qp() and solve_friction() return.")
        .def_readonly(
            "status", &Answer::status,
            R"(How the solve ended. solve_qp(): solved; elastic: the rows contradict each other; iteration-limit; invalid: no finite
answer, x is 0; inaccurate: the solver ended, but the residuals deny it, as where stiffnesses differ by many powers of ten.
solve_friction(): exact; regularized: contacts give way a little; approximate: all that a baseline aims at, and only the
residuals say how near; none: no answer, all forces are 0.)")
        .def_readonly("iterations", &Answer::iterations)
        .def_readonly("x", &Answer::x, "The increment (6,), mm and rad.")
        .def_readonly("forces", &Answer::forces, "Force of each row (m,), or with friction of each contact (m, 3), N.")
        .def_readonly("residuals", &Answer::residuals,
                      "How far the answer is from the conditions of an optimum, or from Coulomb's law.");
    module.def(
        "solvers", [] { return summaries(solverTable()); }, "Names and summaries of the solvers of solve_qp().");
    module.def(
        "friction_solvers", [] { return summaries(frictionSolverTable()); },
        "Names and summaries of the solvers of solve_friction().");
    module.def("solve_qp", solveQp, py::arg("rows"), py::arg("gaps"), py::arg("stiffness"), py::arg("wanted"),
               py::kw_only(), py::arg("solver") = "dual-active-set", py::arg("tolerance") = 0.01,
               py::arg("max_iterations") = 1'000'000, py::arg("paper_form") = false,
               R"(Minimizes ½(x-h)'G(x-h) so that J x >= -g: the quadratic program of a tick.

rows: J (m, 6), of a contact (n, r x n) with a unit normal; gaps: g (m,), mm; stiffness: diagonal of G (6,), N/mm and
mN·m/rad; wanted: h (6,), mm and rad. tolerance: of an approximate solver, N; with paper_form as the paper has it, N·mm.)");
    module.def("solve_friction", solveFriction, py::arg("normals"), py::arg("arms"), py::arg("gaps"),
               py::arg("coefficients"), py::arg("stiffness"), py::arg("wanted"), py::kw_only(),
               py::arg("solver") = "cone-newton",
               R"(Increment and forces of a quasi-static tool with Coulomb friction.

normals: (m, 3), from the obstacle to the tool; arms: (m, 3) from C, mm; gaps: (m,), mm; coefficients: µ (m,);
stiffness and wanted as in solve_qp(). The baselines have limits: lemke-4 takes at most 40 contacts and lemke-8 24, and
gauss-seidel ends after 2000 sweeps, often with large residuals: look at them.)");
}

}  // namespace touchstone::python
