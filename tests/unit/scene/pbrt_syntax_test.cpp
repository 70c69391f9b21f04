#include "core/scene/pbrt_tokens.h"
#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::string MessageOfText(const std::string& text, const PbrtFiles& files = {}) {
    return MessageOf([&] { LoadPbrtText(text, files); });
}

TEST(PbrtTokens, WordsStringsBracketsAndComments) {
    MapSource files;
    files.files["a"] = "Shape\"a b\"[1 -2e-008]# \"no\"\n\t\"x\\\"y\\\\\" end";
    pbrt::Tokens tokens(files, "a");
    std::vector<std::string> texts;
    while (const auto token = tokens.Next()) {
        texts.push_back(token->text);
    }
    EXPECT_THAT(texts, ElementsAre("Shape", "a b", "[", "1", "-2e-008", "]", "x\"y\\", "end"));
}

TEST(PbrtTokens, PlacesCountLinesAndColumnsFromOne) {
    MapSource files;
    files.files["a"] = "one\n  two";
    pbrt::Tokens tokens(files, "a");
    EXPECT_EQ(tokens.Next()->place.Text(), "a:1:1");
    EXPECT_EQ(tokens.Next()->place.Text(), "a:2:3");
}

TEST(PbrtTokens, IncludesGoInTheMiddle) {
    MapSource files;
    files.files["a"] = "one two";
    files.files["sub/b"] = "three # no line end";
    pbrt::Tokens tokens(files, "a");
    tokens.Next();
    tokens.Include("./sub/b", tokens.place());
    EXPECT_EQ(tokens.Next()->place.Text(), "sub/b:1:1");
    EXPECT_EQ(tokens.Next()->text, "two");
    EXPECT_THAT(tokens.names(), ElementsAre("a", "sub/b"));
}

TEST(PbrtSyntax, ErrorsInIncludedFilesNameTheirLine) {
    PbrtFiles files;
    files["inner.pbrt"] = "Translate 1 2\n3\nTranslate 1 2 x\n";
    EXPECT_THAT(MessageOfText("WorldBegin\nInclude \"inner.pbrt\"\n", files),
                AllOf(HasSubstr("inner.pbrt:3:15"), HasSubstr("'x'")));
}

TEST(PbrtSyntax, MissingIncludeNamesBoth) {
    EXPECT_THAT(MessageOfText("\n Include \"gone.pbrt\""),
                AllOf(HasSubstr("scene.pbrt:2:2"), HasSubstr("gone.pbrt")));
}

TEST(PbrtSyntax, HostileIncludesEnd) {
    PbrtFiles files;
    files["loop.pbrt"] = "Include \"loop.pbrt\"";
    EXPECT_THAT(MessageOfText("Include \"loop.pbrt\"", files), HasSubstr("includes itself"));
    // 2^40 files if none stops it.
    PbrtFiles bomb;
    for (int i = 0; i < 40; ++i) {
        const std::string next = "Include \"" + std::to_string(i + 1) + "\"\n";
        bomb[std::to_string(i)] = next + next;
    }
    bomb["40"] = "";
    EXPECT_THAT(MessageOfText("Include \"0\"", bomb), HasSubstr("too many files"));
    EXPECT_THAT(MessageOfText("Include \"../x.pbrt\""), HasSubstr("below the scene's folder"));
    EXPECT_THAT(MessageOfText("Include \"/etc/passwd\""), HasSubstr("below the scene's folder"));
}

TEST(PbrtSyntax, MalformedTextIsToldWithItsPlace) {
    const std::pair<const char*, const char*> cases[] = {
        {"Sphere", "1:1: the directive 'Sphere' is not known"},
        {"\"x\"", "expected a directive"},
        {"Shape", "expected a type"},
        {"Shape \"sphere\" \"float radius\"", "has no value"},
        {"Shape \"sphere\" \"float radius\" [1", "not closed"},
        {"Shape \"sphere\" \"float radius\" [[1]]", "nested"},
        {"Shape \"sphere\" \"float radius\" \"1\"", "takes numbers"},
        {"Shape \"sphere\" \"radius\" 1", "declared as"},
        {"Shape \"sphere\" \"number radius\" 1", "type 'number' is not known"},
        {"Shape \"sphere\" \"float radius\" 1e999", "too large"},
        {"Shape \"sphere\" \"float radius\" nan", "not finite"},
        {"Shape \"sphere\" \"float radius\" [1 2]", "one number"},
        {"Shape \"sphere\" \"integer radius\" 99999999999", "32 bits"},
        {"Shape \"sphere\" \"bool x\" yes", "true or false"},
        {"Shape \"sphere", "no closing quote"},
        {"Transform [1 2 3", "16 numbers"},
        {"Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1]", "not affine"},
        {"AttributeEnd", "AttributeEnd without AttributeBegin"},
        {"AttributeBegin", "not closed"},
        {"AttributeBegin TransformEnd", "AttributeBegin at scene.pbrt:1:1"},
        {"ObjectBegin \"a\" ObjectBegin \"b\"", "inside of an object"},
        {"ObjectInstance \"a\"", "object 'a' is not known"},
        {"NamedMaterial \"a\"", "material 'a' is not known"},
        {"MakeNamedMaterial \"a\"", "has no \"string type\""},
        {"LookAt 0 0 0 0 0 0 0 1 0", "LookAt"},
        {"Scale 0 1 1 Camera \"perspective\"", "singular"},
        {"ActiveTransform Never", "StartTime, EndTime or All"},
        {"Camera \"realistic\"", "cameras of type realistic are not supported"},
        {"Camera \"perspective\" \"float fov\" 180", "fov"},
    };
    for (const auto& [text, message] : cases) {
        EXPECT_THAT(MessageOfText(text), HasSubstr(message)) << text;
    }
}

TEST(PbrtSyntax, NestingIsBounded) {
    std::string text;
    for (int i = 0; i < 100000; ++i) {
        text += "AttributeBegin ";
    }
    EXPECT_THAT(MessageOfText(text), HasSubstr("nested more than"));
}

TEST(PbrtSyntax, BareValuesAndBothKindsOfBooleansAreTaken) {
    const Scene scene = LoadPbrtWorld(
        "Material \"plastic\" \"bool remaproughness\" \"false\" \"float roughness\" 0.25 \"rgb "
        "Kd\" "
        "[.1 .2 .3]\n");
    EXPECT_THAT(Floats(scene.materials[0], "alpha_u"), ElementsAre(0.25f));
    EXPECT_THAT(Floats(scene.materials[0], "base_color"), ElementsAre(0.1f, 0.2f, 0.3f));
    const Scene v4 = LoadPbrtWorld(
        "Material \"coateddiffuse\" \"bool remaproughness\" false \"float roughness\" [ 2.5e-001 "
        "]\n");
    EXPECT_THAT(Floats(v4.materials[0], "alpha_v"), ElementsAre(0.25f));
}

TEST(PbrtSyntax, AttributesAreDefaults) {
    const Scene scene = LoadPbrtWorld(
        "AttributeBegin Attribute \"shape\" \"float radius\" 3\n"
        "Shape \"sphere\" Shape \"sphere\" \"float radius\" 2 AttributeEnd\n");
    EXPECT_NEAR(scene.instances[0].to_world.Vector({1, 0, 0}).x, 3, 1e-6f);
    EXPECT_NEAR(scene.instances[1].to_world.Vector({1, 0, 0}).x, 2, 1e-6f);
    EXPECT_EQ(Text(scene), "");
}

TEST(PbrtNotes, EachUnsupportedThingIsNamedOnceWithItsPlace) {
    const Scene scene = LoadPbrtWorld(
        "Shape \"cone\"\nShape \"cone\"\nMaterial \"hair\"\nShape \"sphere\" \"float nonsense\" 1\n"
        "LightSource \"projection\"\nTexture \"t\" \"float\" \"wrinkled\"\n"
        "Material \"matte\" \"texture sigma\" \"t\" \"float gloss\" 1\n"
        "CoordSysTransform \"nowhere\"\nOption \"seed\" 3\nColorSpace \"rec2020\"\n");
    const std::string notes = Text(scene);
    for (const char* expected :
         {"scene.pbrt:3: shapes of type cone", "scene.pbrt:5: materials of type hair",
          "scene.pbrt:6: shape of type sphere: the parameter \"float nonsense\"",
          "scene.pbrt:7: lights of type projection", "scene.pbrt:8: textures of type wrinkled",
          "scene.pbrt:9: material of type matte: the parameter \"float gloss\"",
          "scene.pbrt:10: the coordinate system 'nowhere'", "scene.pbrt:11: the option 'seed'",
          "scene.pbrt:12: the colour space 'rec2020'"}) {
        EXPECT_THAT(notes, HasSubstr(expected));
    }
    EXPECT_EQ(notes.find("cone"), notes.rfind("cone"));
}

TEST(PbrtFiles, AllThatAreReadAreListed) {
    MapSource files;
    files.files["scene.pbrt"] =
        "WorldBegin Include \"geo/a.pbrt\" Texture \"t\" \"spectrum\" \"imagemap\" \"string "
        "filename\" \"tex/wood 1.png\" Material \"matte\" \"texture Kd\" \"t\"\n"
        "Texture \"unused\" \"spectrum\" \"imagemap\" \"string filename\" \"no.png\"\n"
        "LightSource \"infinite\" \"string mapname\" \"sky.pfm\"\n"
        "AreaLightSource \"diffuse\" \"spectrum L\" \"lamp.spd\"\n"
        "Shape \"plymesh\" \"string filename\" \"geo/m.ply\"\n"
        "Shape \"plymesh\" \"string filename\" \"geo/m.ply\"\n";
    files.files["geo/a.pbrt"] = "";
    files.files["lamp.spd"] = "# watt\n400 1\n700 2\n";
    EXPECT_THAT(ListSceneFiles(files, "scene.pbrt"),
                ElementsAre("scene.pbrt", "geo/a.pbrt", "geo/m.ply", "sky.pfm", "tex/wood 1.png",
                            "lamp.spd"));
    EXPECT_THAT(files.reads, testing::Not(testing::Contains("geo/m.ply")));
}

TEST(PbrtSyntax, WhatAnImportSetsHoldsInItAlone) {
    PbrtFiles files;
    files["part.pbrt"] = std::string("Translate 1 0 0\nMaterial \"mirror\"\n") + kPbrtTriangle;
    const auto load = [&](const char* how) {
        return LoadPbrtText(std::string("WorldBegin\n") + how + " \"part.pbrt\"\n" + kPbrtTriangle,
                            files);
    };
    const Scene included = load("Include"), imported = load("Import");
    ASSERT_EQ(included.instances.size(), 2u);
    ASSERT_EQ(imported.instances.size(), 2u);
    EXPECT_EQ(included.instances[1].to_world.Point({0, 0, 0}).x, 1);
    EXPECT_EQ(imported.instances[0].to_world.Point({0, 0, 0}).x, 1);
    EXPECT_EQ(imported.instances[1].to_world.Point({0, 0, 0}).x, 0);
    const auto type = [](const Scene& scene) {
        const Mesh& mesh = scene.meshes.at(static_cast<std::size_t>(scene.instances[1].mesh));
        return scene.materials.at(static_cast<std::size_t>(mesh.material)).type;
    };
    EXPECT_EQ(type(included), "conductor");
    EXPECT_EQ(type(imported), "diffuse");
    files["part.pbrt"] = "AttributeBegin\n";
    EXPECT_THAT(MessageOf([&] { load("Import"); }), testing::HasSubstr("part.pbrt:1:1: this"));
    files["part.pbrt"] = "AttributeEnd\n";
    EXPECT_THAT(MessageOf([&] { load("Import"); }), testing::HasSubstr("part.pbrt:1:1"));
}

}  // namespace
}  // namespace relume::test
