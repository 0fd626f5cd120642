// Shader files: includes, and errors with file and line.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "engine/view/gl_context.hpp"
#include "engine/view/gl_objects.hpp"

namespace touchstone::shader_tests {

using namespace touchstone::engine;

namespace {

/// A folder of shaders, removed afterwards.
struct ShaderFolder {
    std::filesystem::path path;

    explicit ShaderFolder(const char* name) : path(std::filesystem::path(TOUCHSTONE_BINARY_DIR) / name) {
        std::filesystem::remove_all(path);
        std::filesystem::create_directories(path);
        write("good.vert", "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n");
    }
    ~ShaderFolder() { std::filesystem::remove_all(path); }

    void write(const char* name, const char* text) const { std::ofstream(path / name) << text; }
};

}  // namespace

TEST_CASE("shader: an error names file and line", "[gl]") {
    const HeadlessContext context;
    const ShaderFolder folder("view_shader_error");
    folder.write("bad.frag", "#version 330 core\nout vec4 color;\nvoid main() {\n    color = nonsense;\n}\n");
    REQUIRE_THROWS_WITH(ShaderProgram(folder.path / "good.vert", folder.path / "bad.frag"),
                        Catch::Contains("bad.frag:4:") && Catch::Contains("nonsense"));
}

TEST_CASE("shader: errors in and after an included file name the right place", "[gl]") {
    const HeadlessContext context;
    const ShaderFolder folder("view_shader_include");
    folder.write("part.glsl", "float half_of(float x) {\n    return 0.5 * x;\n}\n");
    folder.write("after.frag",
                 "#version 330 core\n#include \"part.glsl\"\nout vec4 color;\nvoid main() {\n    color = wrong;\n}\n");
    REQUIRE_THROWS_WITH(ShaderProgram(folder.path / "good.vert", folder.path / "after.frag"),
                        Catch::Contains("after.frag:5:"));

    folder.write("part.glsl", "float half_of(float x) {\n    return 0.5 * y;\n}\n");
    REQUIRE_THROWS_WITH(ShaderProgram(folder.path / "good.vert", folder.path / "after.frag"),
                        Catch::Contains("part.glsl:2:"));

    folder.write("part.glsl", "float half_of(float x) {\n    return 0.5 * x;\n}\n");
    folder.write(
        "fine.frag",
        "#version 330 core\n#include \"part.glsl\"\nout vec4 color;\nvoid main() { color = vec4(half_of(1.0)); }\n");
    REQUIRE_NOTHROW(ShaderProgram(folder.path / "good.vert", folder.path / "fine.frag"));
}

TEST_CASE("shader: reports missing and circular includes", "[gl]") {
    const HeadlessContext context;
    const ShaderFolder folder("view_shader_missing");
    REQUIRE_THROWS_WITH(ShaderProgram(folder.path / "good.vert", folder.path / "absent.frag"),
                        Catch::Contains("absent.frag") && Catch::Contains("TOUCHSTONE_SHADERS"));
    folder.write("round.frag", "#version 330 core\n#include \"round.frag\"\n");
    REQUIRE_THROWS_WITH(ShaderProgram(folder.path / "good.vert", folder.path / "round.frag"),
                        Catch::Contains("circular include"));
}

TEST_CASE("shader: an environment variable may set another folder", "[view]") {
    const char* set = std::getenv("TOUCHSTONE_SHADERS");
    const std::optional<std::string> before = set ? std::optional<std::string>(set) : std::nullopt;
    setenv("TOUCHSTONE_SHADERS", "/elsewhere", 1);
    CHECK(shaderDirectory() == "/elsewhere");
    unsetenv("TOUCHSTONE_SHADERS");
    CHECK(std::filesystem::exists(shaderDirectory() / "mesh.frag"));
    if (before) setenv("TOUCHSTONE_SHADERS", before->c_str(), 1);
}

}  // namespace touchstone::shader_tests
