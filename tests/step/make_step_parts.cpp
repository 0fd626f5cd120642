// make_step_parts NAME FILE [KEY=VALUE...]: writes a part or an assembly as a STEP file, for tests.
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopLoc_Location.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gp_Quaternion.hxx>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/step/step_shapes.hpp"
#include "tests/step/step_thread.hpp"

namespace touchstone {
namespace {

/// What may be given on the command line; lengths in mm, whatever the unit of the file.
struct Request {
    std::map<std::string, double> numbers;
    std::string unit = "mm", schema = "AP214", name;
    gp_Trsf pose;  ///< of the whole file's content

    double get(const char* key, double otherwise) {
        used.emplace_back(key);
        const auto found = numbers.find(key);
        return found == numbers.end() ? otherwise : found->second;
    }
    void refuseUnused() const {
        for (const auto& [key, value] : numbers)
            if (std::ranges::find(used, key) == used.end())
                throw std::invalid_argument(key + " does not belong to this part");
    }
    std::vector<std::string> used;
};

/// X,Y,Z,RX,RY,RZ: turned about x, y and z by these degrees, and then moved.
gp_Trsf placed(double x, double y, double z, double rx, double ry, double rz) {
    const double rad = std::numbers::pi / 180;
    gp_Trsf turnX, turnY, turnZ, move;
    turnX.SetRotation(gp::OX(), rx * rad);
    turnY.SetRotation(gp::OY(), ry * rad);
    turnZ.SetRotation(gp::OZ(), rz * rad);
    move.SetTranslation(gp_Vec(x, y, z));
    return move * turnZ * turnY * turnX;
}

/// A document that becomes one file.
class Assembly {
  public:
    Assembly() {
        XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document_);
        shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
        colors_ = XCAFDoc_DocumentTool::ColorTool(document_->Main());
    }
    TDF_Label part(const std::string& name, const TopoDS_Shape& shape, const Quantity_Color& color) {
        if (!BRepCheck_Analyzer(shape).IsValid()) throw std::logic_error(name + " is not a valid solid");
        const TDF_Label made = shapes_->AddShape(shape, false);
        TDataStd_Name::Set(made, name.c_str());
        colors_->SetColor(made, color, XCAFDoc_ColorSurf);
        return made;
    }
    TDF_Label group(const std::string& name) {
        const TDF_Label made = shapes_->NewShape();
        TDataStd_Name::Set(made, name.c_str());
        return made;
    }
    void place(const TDF_Label& group, const std::string& name, const TDF_Label& part, const gp_Trsf& pose) {
        TDataStd_Name::Set(shapes_->AddComponent(group, part, TopLoc_Location(pose)), name.c_str());
    }
    void write(const std::string& file, const Request& request) {
        shapes_->UpdateAssemblies();
        STEPCAFControl_Controller::Init();
        const std::map<std::string, const char*> units{{"mm", "MM"}, {"inch", "INCH"}, {"m", "M"}};
        const std::map<std::string, int> schemas{{"AP203", 3}, {"AP214", 4}, {"AP242", 5}};
        if (!units.contains(request.unit)) throw std::invalid_argument("unit is mm, inch or m");
        if (!schemas.contains(request.schema)) throw std::invalid_argument("schema is AP203, AP214 or AP242");
        Interface_Static::SetCVal("write.step.unit", units.at(request.unit));
        Interface_Static::SetIVal("write.step.schema", schemas.at(request.schema));
        STEPCAFControl_Writer writer;
        if (!writer.Transfer(document_, STEPControl_AsIs) || writer.Write(file.c_str()) != IFSelect_RetDone)
            throw std::runtime_error(file + ": cannot be written");
    }

  private:
    Handle(TDocStd_Document) document_;
    Handle(XCAFDoc_ShapeTool) shapes_;
    Handle(XCAFDoc_ColorTool) colors_;
};

const Quantity_Color kGold(1, 0.77, 0.34, Quantity_TOC_sRGB), kSteel(0.7, 0.72, 0.75, Quantity_TOC_sRGB);

ThreadedPart threadOf(Request& request) {
    ThreadedPart part;
    part.diameter = request.get("diameter", 16);
    part.pitch = request.get("pitch", 2);
    part.starts = int(request.get("starts", 1));
    part.left = request.get("left", 0) != 0;
    part.acrossFlats = request.get("across-flats", 1.5 * part.diameter);
    return part;
}

/// A part of its own. Diameters of holes are given, not clearances, as a drawing has them.
TopoDS_Shape single(const std::string& name, Request& request) {
    if (name == "peg") return shoulderPeg(request.get("diameter", 19.9865), request.get("length", 40));
    if (name == "block") return holedBlock(request.get("diameter", 20.0105), request.get("length", 40));
    if (name == "d-shaft") return flatShaft(request.get("diameter", 12), request.get("length", 25));
    if (name == "d-hub")
        return flatHub(request.get("diameter", 12), request.get("length", 20), request.get("clearance", 0.02));
    if (name == "spline-shaft")
        return splineShaft(request.get("diameter", 20), request.get("length", 25), int(request.get("keys", 6)));
    if (name == "spline-hub")
        return splineHub(request.get("diameter", 20), request.get("length", 25), int(request.get("keys", 6)),
                         request.get("clearance", 0.04));
    if (name == "ball") return ball(request.get("diameter", 19.98), request.get("rod", 6));
    if (name == "socket") return ballSocket(request.get("diameter", 20));
    if (name == "ring") return wireRing(request.get("diameter", 40), request.get("wire", 8));
    if (name == "grooved-shaft") return groovedShaft(request.get("diameter", 40), request.get("wire", 8));
    if (name == "bayonet-plug") return bayonetPlug(request.get("diameter", 20));
    if (name == "bayonet-socket") return bayonetSocket(request.get("diameter", 20), request.get("clearance", 0.1));
    if (name == "gear" || name == "gear-mate") {
        const double module = request.get("module", 2), teeth = request.get("teeth", 20);
        const double width = request.get("width", 10);
        // The other gear's axis lies at x = `distance`, and one of its spaces faces the tooth at +x.
        const TopoDS_Shape made =
            spurGear(module, int(teeth), width, request.get("bore", 10.015), request.get("backlash", 0.2));
        if (name == "gear") return made;
        const double space = std::fmod(teeth, 2) == 0 ? 180 / teeth : 0;
        return BRepBuilderAPI_Transform(made, placed(request.get("distance", 40), 0, 0, 0, 0, space), true).Shape();
    }
    if (name == "gear-pins")
        return gearPins(request.get("distance", 40), request.get("width", 10), request.get("pin", 9.995));
    if (name == "screw") return plainScrew(request.get("diameter", 4.98), request.get("length", 14));
    if (name == "housing")
        return holedHousing(request.get("hole", 5), request.get("depth", 15), request.get("pitch", 20));
    ThreadedPart part = threadOf(request);
    if (name == "bolt") {
        part.inward = request.get("inward", 0.1);
        part.length = request.get("length", 1.5 * part.diameter);
        part.head = 0.625 * part.diameter;
        return threadedBolt(part);
    }
    if (name == "nut") {
        part.length = request.get("height", 0.5 * part.diameter);
        return threadedNut(part);
    }
    throw std::invalid_argument("no such part: " + name);
}

void housingWithScrews(Assembly& file, Request& request) {
    const double pitch = request.get("pitch", 20);
    const TDF_Label all = file.group("housing with screws");
    file.place(all, "housing", file.part("housing", single("housing", request), kSteel), {});
    const TDF_Label screw = file.part("screw", single("screw", request), kGold);
    int number = 0;
    for (const double x : {-pitch, 0.0, pitch})
        for (const double y : {-pitch / 2, pitch / 2}) {
            ++number;
            file.place(all, "screw " + std::to_string(number), screw, placed(x, y, 0, 0, 0, 15 * number));
        }
}

/// Two levels of groups, and a part beside its mirror image.
void nested(Assembly& file) {
    const TDF_Label pin = file.part("pin", plainScrew(8, 12), kGold);
    const TDF_Label right = file.part("bracket", bracket(), kSteel);
    gp_Trsf mirror;
    mirror.SetMirror(gp_Ax2(gp::Origin(), gp::DY()));
    const TDF_Label left =
        file.part("bracket, mirrored", BRepBuilderAPI_Transform(bracket(), mirror, true).Shape(), kSteel);
    const TDF_Label rightSide = file.group("right side"), leftSide = file.group("left side");
    file.place(rightSide, "bracket", right, {});
    file.place(rightSide, "pin", pin, placed(28, 9, 5, 0, 0, 0));
    file.place(leftSide, "bracket", left, {});
    file.place(leftSide, "pin", pin, placed(28, -9, 5, 0, 0, 0));
    const TDF_Label all = file.group("machine");
    file.place(all, "right side", rightSide, placed(100, 0, 20, 0, 0, 30));
    file.place(all, "left side", leftSide, placed(0, 0, 20, 90, 0, 0));
}

void make(const std::string& name, const std::string& path, Request& request) {
    Assembly file;
    if (name == "housing-with-screws") {
        housingWithScrews(file, request);
    } else if (name == "nested") {
        nested(file);
    } else {
        const TopoDS_Shape shape = BRepBuilderAPI_Transform(single(name, request), request.pose, true).Shape();
        file.part(request.name.empty() ? name : request.name, shape, request.get("gold", 0) != 0 ? kGold : kSteel);
    }
    request.refuseUnused();
    file.write(path, request);
}

gp_Trsf readPose(const std::string& text) {
    double v[6]{};
    std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3, v + 4, v + 5);
    return placed(v[0], v[1], v[2], v[3], v[4], v[5]);
}

int run(int count, char** arguments) {
    if (count < 3) throw std::invalid_argument("usage: make_step_parts NAME FILE [KEY=VALUE...]");
    Message::DefaultMessenger()->ChangePrinters().Clear();
    Request request;
    for (int i = 3; i < count; ++i) {
        const std::string text = arguments[i];
        const std::size_t equals = text.find('=');
        if (equals == std::string::npos) throw std::invalid_argument(text + " is not KEY=VALUE");
        const std::string key = text.substr(0, equals), value = text.substr(equals + 1);
        if (key == "unit")
            request.unit = value;
        else if (key == "schema")
            request.schema = value;
        else if (key == "name")
            request.name = value;
        else if (key == "pose")
            request.pose = readPose(value);
        else
            request.numbers[key] = std::stod(value);
    }
    make(arguments[1], arguments[2], request);
    return 0;
}

}  // namespace
}  // namespace touchstone

int main(int count, char** arguments) {
    try {
        return touchstone::run(count, arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_step_parts: %s\n", error.what());
    } catch (const Standard_Failure& failure) {
        std::fprintf(stderr, "make_step_parts: %s\n", failure.GetMessageString());
    }
    return 1;
}
