// The compiled part of the Python package `touchstone`.
#include <system_error>

#include "engine/scene/scene.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace {

namespace py = pybind11;

/// What the program reports about its input is a ValueError, and what the system refuses an OSError.
void translate(std::exception_ptr thrown) {
    try {
        std::rethrow_exception(thrown);
    } catch (const py::builtin_exception&) {
        throw;
    } catch (const touchstone::engine::SceneError&) {
        throw;  // registered below
    } catch (const std::system_error& error) {
        PyErr_SetString(PyExc_OSError, error.what());
    } catch (const std::runtime_error& error) {
        PyErr_SetString(PyExc_ValueError, error.what());
    }
}

/// pybind11 gives an object without a value, as Class.__new__(Class) makes it, uninitialized memory when it is used.
void refuseObjectsWithoutValue(const py::module_& module) {
    for (const auto& [name, value] : py::dict(module.attr("__dict__"))) {
        if (!PyType_Check(value.ptr())) continue;
        if (auto* info = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr())))
            info->operator_new = [](std::size_t) -> void* {
                touchstone::python::raise(PyExc_TypeError,
                                          "this object has no value, since its class was not called to make it");
            };
    }
}

}  // namespace

PYBIND11_MODULE(_core, module) {
    using namespace touchstone::python;
    module.doc() = "Compiled part of the package touchstone.";
    module.attr("__version__") = TOUCHSTONE_VERSION;
    module.attr("tick_type") = tickType();
    py::register_local_exception_translator(translate);
    py::register_exception<touchstone::engine::SceneError>(module, "SceneError", PyExc_ValueError);
    bindSettings(module);
    bindFlags(module);
    bindScenes(module);
    bindWorlds(module);
    bindRuns(module);
    bindSolvers(module);
    bindShapes(module);
    refuseObjectsWithoutValue(module);
}
