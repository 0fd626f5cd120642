// The compiled part of the Python package `touchstone`.
#include "engine/scene/scene.hpp"
#include "tools/python/bindings/bindings.hpp"

PYBIND11_MODULE(_core, module) {
    using namespace touchstone::python;
    module.doc() = "Compiled part of the package touchstone.";
    module.attr("__version__") = TOUCHSTONE_VERSION;
    module.attr("tick_type") = tickType();
    py::register_exception<touchstone::engine::SceneError>(module, "SceneError", PyExc_ValueError);
    bindSettings(module);
    bindScenes(module);
    bindWorlds(module);
    bindRuns(module);
    bindSolvers(module);
    bindShapes(module);
}
