#include <mujoco/mujoco.h>

#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tools/touchstone/referee/rigid_engine.hpp"

namespace touchstone::app {
namespace {

/// A mesh as a binary STL file.
std::string stlOf(const TriangleMesh& mesh) {
    std::string file(80, ' ');
    const auto put = [&](const auto& value) { file.append(reinterpret_cast<const char*>(&value), sizeof value); };
    put(static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles) {
        for (int k = 0; k < 3; ++k) put(0.f);
        for (const std::uint32_t i : triangle)
            for (int k = 0; k < 3; ++k) put(static_cast<float>(mesh.vertices[i][k]));
        put(std::uint16_t{0});
    }
    return file;
}

class Mujoco final : public RigidEngine {
  public:
    explicit Mujoco(const EngineScene& scene) {
        const auto files = std::make_unique<mjVFS>();
        mj_defaultVFS(files.get());
        const auto addFile = [&](const std::string& name, const std::string& content) {
            if (mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(content.size())) != 0)
                throw std::runtime_error("MuJoCo has no room for " + name);
            const int at = mj_findFileVFS(files.get(), name.c_str());
            std::memcpy(files->filedata[at], content.data(), content.size());
        };
        std::ostringstream xml;
        xml.precision(17);
        const double impedance = 2 * scene.step;  // the stiffest that it takes
        xml << "<mujoco><compiler inertiafromgeom='false' boundmass='0' balanceinertia='false'/>"
            << "<option timestep='" << scene.step
            << "' gravity='0 0 0' solver='Newton' cone='elliptic' tolerance='1e-10'/>"
            << "<size nconmax='500' njmax='2000'/><default><geom type='mesh' margin='0' solref='" << impedance
            << " 1' friction='" << std::max(scene.friction, 1e-5) << " 0 0' condim='" << (scene.friction > 0 ? 3 : 1)
            << "'/></default><asset>";
        for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
            addFile("o" + std::to_string(k) + ".stl", stlOf(scene.obstacles[k]));
            xml << "<mesh name='o" << k << "' file='o" << k << ".stl'/>";
        }
        addFile("tool.stl", stlOf(scene.tool));
        const Pose& X = scene.X_WC;
        xml << "<mesh name='tool' file='tool.stl'/></asset><worldbody>";
        for (std::size_t k = 0; k < scene.obstacles.size(); ++k) xml << "<geom mesh='o" << k << "'/>";
        xml << "<body pos='" << X.p.x() << ' ' << X.p.y() << ' ' << X.p.z() << "' quat='" << X.q.w() << ' ' << X.q.x()
            << ' ' << X.q.y() << ' ' << X.q.z() << "'><freejoint/><inertial pos='0 0 0' mass='" << scene.mass
            << "' diaginertia='" << scene.inertia << ' ' << scene.inertia << ' ' << scene.inertia
            << "'/><geom mesh='tool'/></body></worldbody></mujoco>";
        addFile("scene.xml", xml.str());
        char why[500] = "";
        model_ = mj_loadXML("scene.xml", files.get(), why, sizeof why);
        mj_deleteVFS(files.get());
        if (!model_) throw std::runtime_error("MuJoCo refuses the parts: " + std::string(why));
        data_ = mj_makeData(model_);
    }
    ~Mujoco() override {
        mj_deleteData(data_);
        mj_deleteModel(model_);
    }

    BodyState state() const override {
        const mjtNum *p = data_->qpos, *v = data_->qvel;
        const Quat q(p[3], p[4], p[5], p[6]);
        return {{Vec3(p[0], p[1], p[2]), q}, Vec3(v[0], v[1], v[2]), q * Vec3(v[3], v[4], v[5])};
    }
    void step(const Vec3& force, const Vec3& torque) override {
        mjtNum* applied = data_->xfrc_applied + 6;  // of the first body after the world
        for (int k = 0; k < 3; ++k) applied[k] = force[k], applied[3 + k] = torque[k];
        mj_step(model_, data_);
    }

  private:
    mjModel* model_ = nullptr;
    mjData* data_ = nullptr;
};

}  // namespace

std::unique_ptr<RigidEngine> makeMujoco(const EngineScene& scene) { return std::make_unique<Mujoco>(scene); }

}  // namespace touchstone::app
