#include "engine/view/gl_objects.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <glm/gtc/type_ptr.hpp>
#include <stdexcept>
#include <vector>

#include "engine/scene/folders.hpp"

namespace touchstone::engine {
namespace {

/// A shader's text with resolved includes, and the origin of each line. #line directives are not used, because Mesa
/// reports some errors with the wrong source number.
struct ShaderSource {
    std::string text;
    std::vector<std::pair<std::filesystem::path, int>> origin;
};

void append(ShaderSource& source, const std::filesystem::path& file, int depth = 0) {
    constexpr int kMaxDepth = 8;  // a deeper nesting is taken for a circular include
    if (depth > kMaxDepth)
        throw std::runtime_error("Shader " + file.string() + " has a circular include; remove one of the includes.");
    std::ifstream in(file);
    if (!in)
        throw std::runtime_error(
            "Shader " + file.string() +
            " cannot be read; set TOUCHSTONE_SHADERS to the folder with the .vert, .frag and .comp files.");
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (line.starts_with("#include")) {
            const std::size_t open = line.find('"'), close = line.rfind('"');
            if (open == close)
                throw std::runtime_error("Shader " + file.string() + ":" + std::to_string(number) +
                                         ": #include needs a file name in quotation marks.");
            append(source, file.parent_path() / line.substr(open + 1, close - open - 1), depth + 1);
        } else {
            source.text += line + "\n";
            source.origin.emplace_back(file, number);
        }
    }
}

/// The driver's first error message, with its line number translated to file and line. Mesa writes "0:12(5): error:
/// ...", NVIDIA "0(12) : error ...", others "ERROR: 0:12: ...".
std::string readableLog(const std::string& log, const ShaderSource& source) {
    const std::size_t place = std::min(log.find("0:"), log.find("0("));
    const std::size_t text = log.find(": ", place == std::string::npos ? place : place + 2);
    if (text == std::string::npos || source.origin.empty()) return log;
    const long line = std::strtol(log.c_str() + place + 2, nullptr, 10);  // 0 if there is none
    if (line < 1) return log;
    const auto& [file, number] = source.origin[std::min<std::size_t>(line, source.origin.size()) - 1];
    return file.string() + ":" + std::to_string(number) + log.substr(text, log.find('\n') - text);
}

template <class GetParameter, class GetLog>
std::string infoLog(GLuint id, GetParameter getParameter, GetLog getLog) {
    GLint length = 0;
    getParameter(id, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
    getLog(id, length, nullptr, log.data());
    log.resize(log.find_last_not_of(std::string("\0\n", 2)) + 1);
    return log;
}

/// A compiled shader, deleted after linking.
class Shader {
  public:
    Shader(GLenum stage, const std::filesystem::path& file) : id_(glCreateShader(stage)) {
        ShaderSource source;
        append(source, file);
        const char* text = source.text.c_str();
        glShaderSource(id_, 1, &text, nullptr);
        glCompileShader(id_);
        GLint compiled = GL_FALSE;
        glGetShaderiv(id_, GL_COMPILE_STATUS, &compiled);
        if (compiled) return;
        const std::string log = infoLog(id_, glGetShaderiv, glGetShaderInfoLog);
        glDeleteShader(id_);
        throw std::runtime_error("Shader " + file.string() + " does not compile: " + readableLog(log, source));
    }
    ~Shader() { glDeleteShader(id_); }
    Shader(const Shader&) = delete;
    Shader& operator=(const Shader&) = delete;
    GLuint id() const { return id_; }

  private:
    GLuint id_;
};

template <class Generate>
GLuint generate(Generate generator) {
    GLuint id = 0;
    generator(1, &id);
    return id;
}

}  // namespace

GLuint BufferTag::create() { return generate(glGenBuffers); }
void BufferTag::destroy(GLuint id) { glDeleteBuffers(1, &id); }
GLuint VertexArrayTag::create() { return generate(glGenVertexArrays); }
void VertexArrayTag::destroy(GLuint id) { glDeleteVertexArrays(1, &id); }
GLuint TextureTag::create() { return generate(glGenTextures); }
void TextureTag::destroy(GLuint id) { glDeleteTextures(1, &id); }
GLuint RenderbufferTag::create() { return generate(glGenRenderbuffers); }
void RenderbufferTag::destroy(GLuint id) { glDeleteRenderbuffers(1, &id); }
GLuint FramebufferTag::create() { return generate(glGenFramebuffers); }
void FramebufferTag::destroy(GLuint id) { glDeleteFramebuffers(1, &id); }
GLuint ProgramTag::create() { return glCreateProgram(); }
void ProgramTag::destroy(GLuint id) { glDeleteProgram(id); }

Texture::Texture(const Image& image, bool srgb) {
    glBindTexture(GL_TEXTURE_2D, id());
    glTexImage2D(GL_TEXTURE_2D, 0, srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, image.width, image.height, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, image.rgba.data());
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
}

std::filesystem::path shaderDirectory() {
    const char* chosen = std::getenv("TOUCHSTONE_SHADERS");
    return chosen && *chosen ? std::filesystem::path(chosen) : dataFolder("shaders", TOUCHSTONE_SHADER_DIR);
}

ShaderProgram::ShaderProgram(const std::filesystem::path& vertexFile, const std::filesystem::path& fragmentFile) {
    const Shader vertex(GL_VERTEX_SHADER, shaderDirectory() / vertexFile);
    const Shader fragment(GL_FRAGMENT_SHADER, shaderDirectory() / fragmentFile);
    link({vertex.id(), fragment.id()}, "Shaders " + vertexFile.string() + " and " + fragmentFile.string() + " do");
}

ShaderProgram::ShaderProgram(const std::filesystem::path& computeFile) {
    const Shader compute(GL_COMPUTE_SHADER, shaderDirectory() / computeFile);
    link({compute.id()}, "Shader " + computeFile.string() + " does");
}

void ShaderProgram::link(std::initializer_list<GLuint> shaders, const std::string& names) {
    for (const GLuint shader : shaders) glAttachShader(id(), shader);
    glLinkProgram(id());
    for (const GLuint shader : shaders) glDetachShader(id(), shader);
    GLint linked = GL_FALSE;
    glGetProgramiv(id(), GL_LINK_STATUS, &linked);
    if (!linked) throw std::runtime_error(names + " not link: " + infoLog(id(), glGetProgramiv, glGetProgramInfoLog));
}

void ShaderProgram::use() const { glUseProgram(id()); }

GLint ShaderProgram::location(const char* name) const {
    const auto [found, inserted] = locations_.try_emplace(name, -1);
    if (inserted) found->second = glGetUniformLocation(id(), name);
    return found->second;
}

void ShaderProgram::set(const char* name, int value) const { glUniform1i(location(name), value); }
void ShaderProgram::set(const char* name, float value) const { glUniform1f(location(name), value); }
void ShaderProgram::set(const char* name, glm::vec2 value) const { glUniform2f(location(name), value.x, value.y); }
void ShaderProgram::set(const char* name, glm::vec3 value) const {
    glUniform3f(location(name), value.x, value.y, value.z);
}
void ShaderProgram::set(const char* name, glm::vec4 value) const {
    glUniform4f(location(name), value.x, value.y, value.z, value.w);
}
void ShaderProgram::set(const char* name, const glm::mat3& value) const {
    glUniformMatrix3fv(location(name), 1, GL_FALSE, glm::value_ptr(value));
}
void ShaderProgram::set(const char* name, const glm::mat4& value) const {
    glUniformMatrix4fv(location(name), 1, GL_FALSE, glm::value_ptr(value));
}

RenderTarget::RenderTarget(int samples) : samples_(samples) {
    GLint most = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    samples_ = std::clamp(samples, 0, most);
}

void RenderTarget::begin(int width, int height) {
    if (width != width_ || height != height_) {
        const auto attach = [&](const Framebuffer& framebuffer, GLenum point, const Renderbuffer& storage, int samples,
                                GLenum format) {
            glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
            glBindRenderbuffer(GL_RENDERBUFFER, storage.id());
            glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, storage.id());
        };
        attach(multisampled_, GL_COLOR_ATTACHMENT0, color_, samples_, GL_RGBA8);
        attach(multisampled_, GL_DEPTH_STENCIL_ATTACHMENT, depth_, samples_, GL_DEPTH24_STENCIL8);
        attach(plain_, GL_COLOR_ATTACHMENT0, plainColor_, 0, GL_RGBA8);
        for (const Framebuffer* framebuffer : {&multisampled_, &plain_}) {
            glBindFramebuffer(GL_FRAMEBUFFER, framebuffer->id());
            if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
                throw std::runtime_error("The graphics driver cannot make a picture of " + std::to_string(width) +
                                         " x " + std::to_string(height) + " pixels; choose a smaller size.");
        }
        width_ = width;
        height_ = height;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, multisampled_.id());
    glViewport(0, 0, width, height);
}

void RenderTarget::resolve() const {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, multisampled_.id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, plain_.id());
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

}  // namespace touchstone::engine
