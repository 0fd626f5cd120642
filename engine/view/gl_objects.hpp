#pragma once
// RAII owners of OpenGL objects. Each needs a current context over its whole life; a moved-from object is empty.
#include <epoxy/gl.h>

#include <filesystem>
#include <glm/glm.hpp>
#include <initializer_list>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

/// Owner of one OpenGL name. Tag has static GLuint create() and void destroy(GLuint).
template <class Tag>
class GlObject {
  public:
    GlObject() : id_(Tag::create()) {}
    ~GlObject() { reset(); }
    GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
    GlObject& operator=(GlObject&& other) noexcept {
        if (this != &other) {
            reset();
            id_ = std::exchange(other.id_, 0);
        }
        return *this;
    }
    GLuint id() const { return id_; }

  private:
    void reset() {
        if (id_) Tag::destroy(id_);
    }
    GLuint id_;
};

struct BufferTag {
    static GLuint create();
    static void destroy(GLuint id);
};
struct VertexArrayTag {
    static GLuint create();
    static void destroy(GLuint id);
};
struct TextureTag {
    static GLuint create();
    static void destroy(GLuint id);
};
struct RenderbufferTag {
    static GLuint create();
    static void destroy(GLuint id);
};
struct FramebufferTag {
    static GLuint create();
    static void destroy(GLuint id);
};
struct ProgramTag {
    static GLuint create();
    static void destroy(GLuint id);
};

using VertexArray = GlObject<VertexArrayTag>;
using Renderbuffer = GlObject<RenderbufferTag>;
using Framebuffer = GlObject<FramebufferTag>;

/// A buffer of vertices, indices or instances.
class Buffer : public GlObject<BufferTag> {
  public:
    /// Replaces the content; leaves the buffer bound to `target`.
    template <class T>
    void write(GLenum target, std::span<const T> values, GLenum usage) {
        glBindBuffer(target, id());
        glBufferData(target, static_cast<GLsizeiptr>(values.size_bytes()), values.data(), usage);
    }
    /// Replaces the content by `bytes` that nobody has written; leaves the buffer bound to `target`.
    void reserve(GLenum target, std::size_t bytes, GLenum usage) {
        glBindBuffer(target, id());
        glBufferData(target, static_cast<GLsizeiptr>(bytes), nullptr, usage);
    }
};

/// A 2-D texture.
class Texture : public GlObject<TextureTag> {
  public:
    Texture() = default;
    /// Creates mipmaps. `srgb`: the image holds sRGB colors; else its values are used unchanged.
    Texture(const Image& image, bool srgb);
};

/// Folder of the GLSL files: the environment variable TOUCHSTONE_SHADERS, else the folder set at build time.
std::filesystem::path shaderDirectory();

/// A linked vertex and fragment shader, or a compute shader, which needs OpenGL 4.3. Names are relative to
/// shaderDirectory(), or absolute paths. A line
/// `#include "file"` in a shader is replaced by that file, found beside the including one.
/// Throws std::runtime_error naming file and line of the first error, or the missing file and the remedy.
class ShaderProgram : public GlObject<ProgramTag> {
  public:
    ShaderProgram(const std::filesystem::path& vertexFile, const std::filesystem::path& fragmentFile);
    explicit ShaderProgram(const std::filesystem::path& computeFile);

    void use() const;

    /// Sets a uniform of the program in use. Names that the shader does not use are ignored.
    void set(const char* name, int value) const;
    void set(const char* name, float value) const;
    void set(const char* name, glm::vec2 value) const;
    void set(const char* name, glm::vec3 value) const;
    void set(const char* name, glm::vec4 value) const;
    void set(const char* name, const glm::mat3& value) const;
    void set(const char* name, const glm::mat4& value) const;

  private:
    void link(std::initializer_list<GLuint> shaders, const std::string& names);
    GLint location(const char* name) const;
    mutable std::unordered_map<std::string, GLint> locations_;
};

/// A multisampled color, depth and stencil target, and the single-sample target it is resolved into. Sized on demand.
class RenderTarget {
  public:
    explicit RenderTarget(int samples);  ///< upper bound; limited by the driver's maximum

    /// Binds the multisampled framebuffer, reallocated if the size changed, and sets the GL viewport.
    void begin(int width, int height);

    /// Resolves the samples into resolved().
    void resolve() const;

    const Framebuffer& resolved() const { return plain_; }

  private:
    int samples_, width_ = 0, height_ = 0;
    Framebuffer multisampled_, plain_;
    Renderbuffer color_, depth_, plainColor_;
};

}  // namespace touchstone::engine
