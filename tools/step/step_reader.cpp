#include "tools/step/step_reader.hpp"

#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message_ProgressIndicator.hxx>
#include <Message_ProgressScope.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepGeom_CartesianTransformationOperator3d.hxx>
#include <StepGeom_Direction.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDF_Tool.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "tools/step/step_faces.hpp"

namespace touchstone::step {

using engine::CadAssembly;
using engine::CadPart;
using engine::CadShape;

namespace {

constexpr std::size_t kMostParts = 100'000;
constexpr double kLeastVolume = 1e-18;  // m³: a cube of 1 µm
constexpr int kDeepest = 100;           // levels of assemblies: files that contain themselves have no end

/// Passes Open Cascade's progress on.
class Reported : public Message_ProgressIndicator {
  public:
    Reported(const Progress& progress, std::string what, double from, double to)
        : progress_(progress), what_(std::move(what)), from_(from), to_(to) {}
    void Show(const Message_ProgressScope&, Standard_Boolean) override {
        progress_(what_, from_ + (to_ - from_) * GetPosition());
    }

  private:
    const Progress& progress_;
    std::string what_;
    double from_, to_;
};

std::string nameOf(const TDF_Label& label) {
    Handle(TDataStd_Name) name;
    if (!label.FindAttribute(TDataStd_Name::GetID(), name)) return {};
    const TCollection_ExtendedString& text = name->Get();
    std::string utf8(std::size_t(text.LengthOfCString()) + 1, '\0');
    Standard_PCharacter start = utf8.data();
    utf8.resize(std::size_t(text.ToUTF8CString(start)));
    return utf8;
}

/// Whether nobody chose the name: Open Cascade and many CAD programs number the places of parts.
bool isNumbered(const std::string& name) {
    return name.empty() || name.starts_with("=>") || name.starts_with("NAUO") ||
           name.find_first_not_of("0123456789") == name.npos;
}

glm::dmat4 matrixOf(const gp_Trsf& placement) {
    glm::dmat4 matrix(1);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) matrix[column][row] = placement.Value(row + 1, column + 1);
        matrix[3][row] = placement.Value(row + 1, 4) * kMetersPerUnit;
    }
    return matrix;
}

class TreeReader {
  public:
    TreeReader(StepContent& content, const Handle(TDocStd_Document) & document)
        : content_(content),
          shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
          colors_(XCAFDoc_DocumentTool::ColorTool(document->Main())) {}

    void read() {
        TDF_LabelSequence roots;
        shapes_->GetFreeShapes(roots);
        if (roots.Length() == 1) content_.assembly.name = nameOf(roots.First());
        for (const TDF_Label& root : roots) visit(root, {}, "", {}, 0);
        makeUnique();
    }

  private:
    void visit(const TDF_Label& label, const gp_Trsf& above, const std::string& path, std::optional<glm::vec3> color,
               int depth) {
        if (depth > kDeepest)
            throw std::runtime_error("has more than " + std::to_string(kDeepest) +
                                     " levels of assemblies: export a flatter assembly");
        gp_Trsf placement = above;
        placement.Multiply(XCAFDoc_ShapeTool::GetLocation(label).Transformation());
        TDF_Label shape = label;
        if (XCAFDoc_ShapeTool::IsReference(label)) XCAFDoc_ShapeTool::GetReferredShape(label, shape);
        std::string name = nameOf(label);
        if (isNumbered(name)) name = nameOf(shape);
        const std::string own = path.empty() ? name : path + "/" + name;
        for (const TDF_Label& place : {shape, label})
            if (!color || place == label)
                if (const auto given = colorOf(place)) color = given;
        if (XCAFDoc_ShapeTool::IsAssembly(shape)) {
            TDF_LabelSequence components;
            XCAFDoc_ShapeTool::GetComponents(shape, components);
            for (const TDF_Label& component : components) visit(component, placement, own, color, depth + 1);
            return;
        }
        if (content_.assembly.parts.size() >= kMostParts)
            throw std::runtime_error("has more than " + std::to_string(kMostParts) +
                                     " parts: export the subassembly that is assembled, without fasteners and cables");
        CadPart part;
        part.name = name;
        part.path = own;
        part.placement = matrixOf(placement);
        part.shape = shapeOf(shape);
        part.color = color ? color : colorOfFaces(shape);
        content_.assembly.parts.push_back(std::move(part));
    }

    std::optional<glm::vec3> colorOf(const TDF_Label& label) const {
        Quantity_Color color;
        for (const XCAFDoc_ColorType type : {XCAFDoc_ColorSurf, XCAFDoc_ColorGen})
            if (colors_->GetColor(label, type, color)) return glm::vec3(color.Red(), color.Green(), color.Blue());
        return {};
    }

    /// That of the first solid or face with a color.
    std::optional<glm::vec3> colorOfFaces(const TDF_Label& label) const {
        TDF_LabelSequence pieces;
        XCAFDoc_ShapeTool::GetSubShapes(label, pieces);
        for (const TDF_Label& piece : pieces)
            if (const auto color = colorOf(piece)) return color;
        return {};
    }

    /// Index of the shape, which several parts may have.
    std::uint32_t shapeOf(const TDF_Label& label) {
        TCollection_AsciiString entry;
        TDF_Tool::Entry(label, entry);
        const auto [place, isNew] = indexOf_.emplace(entry.ToCString(), std::uint32_t(content_.solids.size()));
        if (!isNew) return place->second;
        CadShape& shape = content_.assembly.shapes.emplace_back();
        TopoDS_Shape& solids = content_.solids.emplace_back();
        try {
            solids = solidsOf(XCAFDoc_ShapeTool::GetShape(label), shape.problem);
            if (solids.IsNull()) return place->second;
            int without = 0;
            for (const TopoDS_Face& face : facesOf(solids)) {
                shape.faces.push_back(describe(face));
                without += shape.faces.back().area < kLeastArea;
            }
            if (without > 0)
                content_.assembly.notes.push_back(
                    "part '" + nameOf(label) + "' has " + std::to_string(without) +
                    (without == 1 ? " face" : " faces") +
                    " without area, left out: if its mesh does not close, heal the part in the CAD program");
            GProp_GProps volume;
            BRepGProp::VolumeProperties(solids, volume);
            shape.volume = volume.Mass() * kMetersPerUnit * kMetersPerUnit * kMetersPerUnit;
            if (shape.volume < kLeastVolume) {
                shape.problem = "encloses no volume: check its sizes in the CAD program, and export it again";
                solids.Nullify();
            }
        } catch (const Standard_Failure& failure) {
            solids.Nullify();
            shape.faces.clear();
            shape.problem = std::string("has geometry that Open Cascade cannot evaluate (") +
                            failure.GetMessageString() + "): heal it in the CAD program, and export it again";
        }
        return place->second;
    }

    /// Numbers parts of the same name: "screw", "screw 2", ...
    void makeUnique() {
        std::set<std::string> taken;
        std::map<std::string, int> counts;
        for (CadPart& part : content_.assembly.parts) {
            if (part.name.empty()) part.name = "part";
            const std::string name = part.name;
            while (!taken.insert(part.name).second) part.name = name + " " + std::to_string(++counts[name] + 1);
            if (part.name != name) part.path = part.path.substr(0, part.path.rfind('/') + 1) + part.name;
        }
    }

    StepContent& content_;
    Handle(XCAFDoc_ShapeTool) shapes_;
    Handle(XCAFDoc_ColorTool) colors_;
    std::map<std::string, std::uint32_t> indexOf_;
};

/// The unit that the file gives lengths in: "INCH" is in.
void setUnit(CadAssembly& assembly, STEPCAFControl_Reader& reader) {
    TColStd_SequenceOfAsciiString lengths, angles, solidAngles;
    reader.ChangeReader().FileUnits(lengths, angles, solidAngles);
    std::string unit = lengths.IsEmpty() ? "" : lengths.First().ToCString();
    for (char& c : unit) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    struct Known {
        const char *word, *unit;
        double meters;
    };
    for (const Known& known :
         {Known{"millimet", "mm", 1e-3}, Known{"centimet", "cm", 1e-2}, Known{"inch", "in", 0.0254},
          Known{"foot", "ft", 0.3048}, Known{"micromet", "µm", 1e-6}, Known{"metre", "m", 1}, Known{"meter", "m", 1}})
        if (unit.starts_with(known.word)) {
            assembly.unit = known.unit;
            assembly.metersPerUnit = known.meters;
            return;
        }
    assembly.unit = unit.empty() ? "mm" : unit;
}

/// The text of a file without its comments, within which Open Cascade misreads entities; empty if it has none.
std::string withoutComments(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    if (text.find("/*") == text.npos) return {};
    std::string rest;
    rest.reserve(text.size());
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '\'') quoted = !quoted;
        if (!quoted && text.compare(i, 2, "/*") == 0) {
            const std::size_t end = text.find("*/", i + 2);
            if (end == text.npos) break;
            i = end + 1;
            rest += ' ';
        } else {
            rest += text[i];
        }
    }
    return rest;
}

/// The number of operators that mirror a part, which Open Cascade 7.6 takes for turns.
int mirrors(STEPCAFControl_Reader& reader) {
    int count = 0;
    const Handle(Interface_InterfaceModel) model = reader.ChangeReader().Model();
    for (int i = 1; i <= model->NbEntities(); ++i) {
        const auto placed = Handle(StepGeom_CartesianTransformationOperator3d)::DownCast(model->Value(i));
        if (placed.IsNull() || !placed->HasAxis1() || !placed->HasAxis2() || !placed->HasAxis3()) continue;
        glm::dmat3 axes(1);
        const Handle(StepGeom_Direction) given[]{placed->Axis1(), placed->Axis2(), placed->Axis3()};
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 3 && c < given[k]->NbDirectionRatios(); ++c)
                axes[k][c] = given[k]->DirectionRatiosValue(c + 1);
        count += glm::determinant(axes) < 0;
    }
    return count;
}

}  // namespace

StepContent readContent(const std::string& file, const Progress& progress) {
    StepContent content;
    Handle(TDocStd_Document) document = new TDocStd_Document("BinXCAF");
    STEPCAFControl_Reader reader;
    reader.SetColorMode(true);
    reader.SetNameMode(true);
    reader.SetLayerMode(false);
    reader.SetPropsMode(false);
    reader.SetGDTMode(false);
    reader.SetMatMode(false);
    reader.SetViewMode(false);
    Interface_Static::SetCVal("xstep.cascade.unit", "MM");
    const std::string reading = "reading " + file.substr(file.rfind('/') + 1);
    progress(reading, 0);
    std::istringstream text(withoutComments(file));
    if ((text.view().empty() ? reader.ReadFile(file.c_str()) : reader.ChangeReader().ReadStream(file.c_str(), text)) !=
        IFSelect_RetDone)
        throw std::runtime_error(file +
                                 ": Open Cascade cannot read it as STEP, as it is malformed: export or copy it again");
    setUnit(content.assembly, reader);
    if (const int count = mirrors(reader); count > 0)
        content.assembly.notes.push_back("mirrors " + std::to_string(count) + (count == 1 ? " part" : " parts") +
                                         " by an operator that Open Cascade takes for a turn: export mirrored parts as "
                                         "solids of their own");
    progress(reading, 0.3);
    const Handle(Reported) reported = new Reported(progress, reading, 0.3, 1);
    if (reader.ChangeReader().NbRootsForTransfer() == 0 || !reader.Transfer(document, reported->Start()))
        throw std::runtime_error(
            file + ": holds no part that can be read: export the parts as solids, as AP203, AP214 or AP242");
    try {
        TreeReader(content, document).read();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(file + ": " + error.what());
    }
    if (content.assembly.parts.empty())
        throw std::runtime_error(file + ": is an assembly without parts: export it with the parts inside, in one file");
    return content;
}

}  // namespace touchstone::step
