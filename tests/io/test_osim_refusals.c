/* SPDX-License-Identifier: Apache-2.0 */
/* .osim reader: mistakes with their lines, things that cannot be said by name; files by content. */
#include "io/model_file.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DOCUMENT(content)                                                  \
    "<OpenSimDocument Version=\"40000\">\n<Model name=\"test\">\n" content \
    "</Model></OpenSimDocument>\n"
#define SET(name, content) "<" name "><objects>\n" content "</objects></" name ">\n"
/* lines 3 to 11 of a document: body in 4 to 7, joint in 10; objects that follow begin in line 13 */
#define ARM_WITH(body, joint)                                                                 \
    SET("BodySet", "<Body name=\"arm\">\n<mass>1</mass>\n" body "</Body>\n")                  \
    SET("JointSet", "<PinJoint name=\"j\"><socket_parent_frame>/ground</socket_parent_frame>" \
                    "<socket_child_frame>/bodyset/arm</socket_child_frame>" joint "</PinJoint>\n")
#define ARM ARM_WITH("<!-- -->\n", "")
#define POINTS                                                                             \
    "<PathPoint name=\"p\"><socket_parent_frame>/ground</socket_parent_frame></PathPoint>" \
    "<PathPoint name=\"q\"><socket_parent_frame>/bodyset/arm</socket_parent_frame></PathPoint>"
#define MUSCLE_WITH(type, points, path, extra)                              \
    "<" type " name=\"m\">\n<GeometryPath><PathPointSet><objects>\n" points \
    "</objects></PathPointSet>" path "</GeometryPath>\n"                    \
    "<optimal_fiber_length>0.1</optimal_fiber_length>"                      \
    "<tendon_slack_length>0.2</tendon_slack_length>" extra "</" type ">\n"
#define MUSCLE(extra) MUSCLE_WITH("Thelen2003Muscle", POINTS, "", extra)
#define F100 "<max_isometric_force>100</max_isometric_force>"
#define MARKER(frame, at)                                                                      \
    SET("MarkerSet", "<Marker name=\"M\"><socket_parent_frame>" frame "</socket_parent_frame>" \
                     "<location>" at "</location></Marker>\n")
#define AXIS(content)                                                                             \
    DOCUMENT(SET("BodySet", "<Body name=\"b\"/>\n")                                               \
                 SET("JointSet", "<CustomJoint name=\"j\">"                                       \
                                 "<socket_parent_frame>/ground</socket_parent_frame>"             \
                                 "<socket_child_frame>b</socket_child_frame><coordinates>"        \
                                 "<Coordinate name=\"q\"/><Coordinate name=\"r\"/></coordinates>" \
                                 "<SpatialTransform>\n<TransformAxis name=\"rotation1\">" content \
                                 "</TransformAxis></SpatialTransform></CustomJoint>\n"))

#define WRAP(object)                                                  \
    "<PathWrapSet><objects><PathWrap name=\"w\"><wrap_object>" object \
    "</wrap_object></PathWrap></objects></PathWrapSet>"
#define CYLINDER(name, radius)                                                \
    "<WrapObjectSet><objects><WrapCylinder name=\"" name "\"><radius>" radius \
    "</radius></WrapCylinder></objects></WrapObjectSet>\n"
#define CONDITIONAL(coordinate, range)                                 \
    "<ConditionalPathPoint name=\"c\"><socket_parent_frame>/ground"    \
    "</socket_parent_frame><socket_coordinate>/jointset/j/" coordinate \
    "</socket_coordinate><range>" range "</range></ConditionalPathPoint>"
/* lines 3 to 11; a coupler that follows stands in line 13 */
#define TWO                                                                             \
    SET("BodySet", "<Body name=\"a\"/>\n<Body name=\"b\"/>\n")                          \
    SET("JointSet", "<PinJoint name=\"i\"><socket_parent_frame>ground"                  \
                    "</socket_parent_frame><socket_child_frame>a</socket_child_frame>"  \
                    "<coordinates><Coordinate name=\"p\"/></coordinates></PinJoint>\n"  \
                    "<PinJoint name=\"j\"><socket_parent_frame>a</socket_parent_frame>" \
                    "<socket_child_frame>b</socket_child_frame><coordinates>"           \
                    "<Coordinate name=\"q\"/></coordinates></PinJoint>\n\n")
#define COUPLER(name, independent, dependent)                                       \
    "<CoordinateCouplerConstraint name=\"" name "\"><coupled_coordinates_function>" \
    "<LinearFunction><coefficients>2 1</coefficients></LinearFunction>"             \
    "</coupled_coordinates_function><independent_coordinate_names>" independent     \
    "</independent_coordinate_names><dependent_coordinate_name>" dependent          \
    "</dependent_coordinate_name></CoordinateCouplerConstraint>\n"

static void mistakes_are_named_with_their_line(void **state) {
    (void)state;
    const struct {
        const char *text, *message;
    } cases[] = {
        {"<OpenSimDocument>\n<Model>\n</Modl></OpenSimDocument>",
         "m:3: Opening and ending tag mismatch: Model line 2 and Modl"},
        {"", "m:1: Document is empty"},
        {"<VTKFile/>", "m:1: not an OpenSim model: the outermost element is <VTKFile>, not "
                       "<OpenSimDocument>"},
        {"<OpenSimDocument/>", "m:1: <OpenSimDocument> holds no <Model>"},
        {"<!DOCTYPE a [<!ENTITY b \"c\">]>\n" DOCUMENT(ARM),
         "m: a document type declaration has no place in a model file"},
        {DOCUMENT(SET("BodySet", "<Body name=\"arm\"><mass>-2</mass></Body>\n")),
         "m:4: body 'arm' has a negative mass (-2 kg)"},
        {DOCUMENT(SET("BodySet", "<Body name=\"arm\">\n<mass>heavy</mass></Body>\n")),
         "m:5: <mass>: 'heavy' is no finite number"},
        {DOCUMENT(SET("BodySet", "<Body name=\"arm\">\n<mass>nan</mass></Body>\n")),
         "m:5: <mass>: 'nan' is no finite number"},
        {DOCUMENT(ARM_WITH("<mass_center>1 2</mass_center>\n", "")),
         "m:6: <mass_center> holds 2 numbers; it takes 3"},
        {DOCUMENT(ARM_WITH("\n", "<coordinates><Coordinate name=\"q\"><range>1 0</range>"
                                 "</Coordinate></coordinates>")),
         "m:10: the range of coordinate 'q' ends (0) before it begins (1)"},
        {DOCUMENT(SET("BodySet", "<Body name=\"b\"/>\n<Body name=\"b\"/>\n")),
         "m:5: body 'b' is there twice (first in line 4)"},
        {DOCUMENT(ARM MARKER("/bodyset/Arn", "0 0 0")),
         "m:13: '/bodyset/Arn' is no body or frame (did you mean 'arm'?)"},
        {DOCUMENT(ARM MARKER("/bodyset/arm", "0 0")),
         "m:13: <location> holds 2 numbers; it takes 3"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE("<max_isometric_force>-1</max_isometric_force>"))),
         "m:13: muscle 'm': the maximal isometric force cannot be -1"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle", "", "", F100))),
         "m:13: muscle 'm' has 0 path points; it needs at least 2"},
        {DOCUMENT(ARM SET("ForceSet", "<Thelen2003Muscle name=\"m\"/>\n")),
         "m:13: muscle 'm' has no GeometryPath"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE(F100) MUSCLE(F100))),
         "m:17: muscle 'm' is there twice (first in line 13)"},
        {DOCUMENT(
             ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                             "<PathPoint><body>leg</body></PathPoint>", "", F100))),
         "m:15: 'leg' is no body or frame (valid: arm, ground)"},
        {AXIS("<coordinates>q</coordinates><axis>0 0 0</axis>"),
         "m:8: the axis of a motion of 'b' has no length"},
        {AXIS("<coordinates>s</coordinates><axis>1 0 0</axis>"),
         "m:8: joint 'j' has no coordinate 's' (did you mean 'q'?)"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><SimmSpline><x>0 1 1</x><y>0 1 2</y>"
              "</SimmSpline>"),
         "m:8: <SimmSpline> of rotation1 of joint 'j': x does not increase at 1"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><SimmSpline><x>0 1</x><y>0</y>"
              "</SimmSpline>"),
         "m:8: <SimmSpline> of rotation1 of joint 'j' needs as many x as y, at least 2 (has 2 and "
         "1)"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><SimmSpline><x>0 1</x><y>0 nan</y>"
              "</SimmSpline>"),
         "m:8: <y>: 'nan' is no finite number"},
        {DOCUMENT(
             ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle", POINTS, WRAP("elbow"), F100))),
         "m:15: muscle 'm' wraps around 'elbow', which no body has"},
        {DOCUMENT(ARM_WITH(CYLINDER("elbows", "0"), "") SET(
             "ForceSet", MUSCLE_WITH("Thelen2003Muscle", POINTS, WRAP("elbow"), F100))),
         "m:15: muscle 'm' wraps around 'elbow', which no body has (did you mean 'elbows'?)"},
        {DOCUMENT(ARM_WITH(CYLINDER("elbow", "0"), "") SET(
             "ForceSet", MUSCLE_WITH("Thelen2003Muscle", POINTS, WRAP("elbow"), F100))),
         "m:6: cylinder 'elbow' needs a size > 0, not 0"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                                  POINTS CONDITIONAL("k", "0 1"), "", F100))),
         "m:15: ConditionalPathPoint 'c' of muscle 'm' names an unknown coordinate 'k' (valid: "
         "j_coord_0)"},
        {DOCUMENT(
             ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                             POINTS CONDITIONAL("j_coord_0", "1 0"), "", F100))),
         "m:15: ConditionalPathPoint 'c' of muscle 'm': its range ends (0) before it begins (1)"},
        {DOCUMENT(ARM SET("ForceSet",
                          MUSCLE_WITH("Thelen2003Muscle",
                                      POINTS "\n<MovingPathPoint name=\"v\"><body>arm</body>"
                                             "<x_coordinate>jcoord_0</x_coordinate><x_location>"
                                             "<LinearFunction/></x_location></MovingPathPoint>",
                                      "", F100))),
         "m:16: MovingPathPoint 'v' of muscle 'm' names an unknown coordinate 'jcoord_0' (did you "
         "mean 'j_coord_0'?)"},
        {DOCUMENT(TWO SET("ConstraintSet", COUPLER("c", "p q", "r"))),
         "m:13: coupler 'c' has several independent coordinates (p q); a dependent one can follow "
         "only one"},
        {DOCUMENT(TWO SET("ConstraintSet", COUPLER("c", "p", "q") COUPLER("d", "q", "p"))),
         "m:14: coupler 'd' closes a circle: 'p' depends on 'q', which depends on it"},
        {DOCUMENT(TWO SET("ConstraintSet", COUPLER("c", "p", "q") COUPLER("d", "p", "q"))),
         "m:14: coordinate 'q' has a coupler already ('c', line 13)"},
        {DOCUMENT(
             ARM SET("ConstraintSet",
                     "<PointConstraint name=\"pin\"><socket_body_1>/bodyset/arm</socket_body_1>"
                     "<socket_body_2>/bodyset/arm</socket_body_2></PointConstraint>")),
         "m:13: PointConstraint 'pin' holds 'arm' to itself"},
        {DOCUMENT(ARM_WITH("\n", "<coordinates><Coordinate name=\"q\"><locked>maybe</locked>"
                                 "</Coordinate></coordinates>")),
         "m:10: <locked> can be true or false, not 'maybe'"},
        {DOCUMENT(ARM_WITH("\n", "<coordinates><Coordinate/></coordinates>")),
         "m:10: this coordinate has no name"},
        {DOCUMENT(ARM SET("MarkerSet", "<Marker><body>arm</body><location>0 0 0</location>"
                                       "</Marker>\n")),
         "m:13: this marker has no name"},
        {DOCUMENT(ARM SET("MarkerSet", "<Marker name=\"a&#10;b\"><body>arm</body><location>0 0 0"
                                       "</location></Marker>\n")),
         "m:13: marker 'a b' has a control character (0x0a) in its name, which no table of "
         "results could hold"},
        {DOCUMENT(SET("BodySet", "<Body name=\"a\"/>\n<Body name=\"a\"/>\n")
                      SET("JointSet", "<PinJoint name=\"j\"><socket_parent_frame>a"
                                      "</socket_parent_frame><socket_child_frame>b"
                                      "</socket_child_frame></PinJoint>\n")),
         "m:5: body 'a' is there twice (first in line 4)"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE(F100 "<Af>0</Af>"))),
         "m:13: muscle 'm': the force-velocity shape cannot be 0"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE(F100 "<Flen>1</Flen>"))),
         "m:13: muscle 'm': the maximal lengthening force cannot be 1"},
        {DOCUMENT(ARM_WITH(CYLINDER("elbow", "0.1"), "") SET(
             "ForceSet",
             MUSCLE_WITH("Thelen2003Muscle", POINTS,
                         "<PathWrapSet><objects><PathWrap name=\"w\"><wrap_object>elbow"
                         "</wrap_object><range>1.5 2</range></PathWrap></objects></PathWrapSet>",
                         F100))),
         "m:15: the range of a wrap of muscle 'm' is 1.5 2; it takes numbers of points"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><SimmSpline><x>0 1e-300 1</x>"
              "<y>0 1 2</y></SimmSpline>"),
         "m:8: <SimmSpline> of rotation1 of joint 'j': its slopes are beyond any number: are two x "
         "as good as the same?"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><SimmSpline>"
              "<x>0 1 1.0000000000000002</x><y>0 1 2</y></SimmSpline>"),
         "m:8: <SimmSpline> of rotation1 of joint 'j': x does not increase at 1"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><GCVSpline><half_order>2.5"
              "</half_order><x>0 1 2 3 4 5</x><y>0 1 2 3 4 5</y></GCVSpline>"),
         "m:8: <GCVSpline> of rotation1 of joint 'j': half_order 2.5 needs to be 1, 2, 3 or 4, and "
         "at least twice as many points as that (has 6)"},
        {DOCUMENT(TWO SET("ConstraintSet", COUPLER("c", "p", "knee"))),
         "m:13: coupler 'c' names an unknown coordinate 'knee' (valid: p, q)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_description *d = NULL;
        mhe_error err = {0};
        mhe_status status = mhi_osim_parse("m", cases[i].text, strlen(cases[i].text), &d, &err);
        assert_string_equal(err.text, cases[i].message);
        assert_int_equal(status, MHE_E_INPUT);
        assert_null(d);
    }
}

static void frames_and_bodies_in_a_circle(void **state) {
    (void)state;
    const char *frames = DOCUMENT(
        ARM MARKER("f", "0 0 0") "<components><PhysicalOffsetFrame name=\"f\"><socket_parent>/g"
                                 "</socket_parent></PhysicalOffsetFrame><PhysicalOffsetFrame "
                                 "name=\"g\"><socket_parent>/f</socket_parent>"
                                 "</PhysicalOffsetFrame></components>\n");
    const char *bodies = DOCUMENT(SET("BodySet", "<Body name=\"a\"/>\n<Body name=\"b\"/>\n")
                                      SET("JointSet", "<WeldJoint name=\"i\">"
                                                      "<socket_parent_frame>a</socket_parent_frame>"
                                                      "<socket_child_frame>b</socket_child_frame>"
                                                      "</WeldJoint><WeldJoint name=\"j\">"
                                                      "<socket_parent_frame>b</socket_parent_frame>"
                                                      "<socket_child_frame>a</socket_child_frame>"
                                                      "</WeldJoint>"));
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_osim_parse("m", frames, strlen(frames), &d, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "m:15: frame '/f' is fixed to itself");
    assert_int_equal(mhi_osim_parse("m", bodies, strlen(bodies), &d, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "m:4: body 'a' is its own ancestor");
}

/* Each document holds one thing that a description cannot carry. */
static void unsupported_things_are_named(void **state) {
    (void)state;
    const struct {
        const char *text, *unsupported;
    } cases[] = {
        {DOCUMENT(ARM SET("ConstraintSet", "<ConstantDistanceConstraint name=\"c\"/>\n")),
         "m:13: ConstantDistanceConstraint 'c': not enforced"},
        {DOCUMENT(ARM SET("ForceSet", "<ExpressionBasedCoordinateForce name=\"l\"/>\n")),
         "m:13: ExpressionBasedCoordinateForce 'l': its force is missing"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                                  POINTS "\n<StationPoint "
                                                         "name=\"c\"/>",
                                                  "", F100))),
         "m:16: StationPoint 'c' of muscle 'm': the path goes without it"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE_WITH("Delp1990Muscle_Deprecated", POINTS, "", F100))),
         "m:13: the curves of Delp1990Muscle_Deprecated 'm': those of the muscle plugin's own "
         "choice act"},
        {DOCUMENT(ARM_WITH("\n", "<coordinates><Coordinate name=\"q\"><prescribed>true</prescribed>"
                                 "<prescribed_function><LinearFunction><coefficients>2 0.5"
                                 "</coefficients></LinearFunction></prescribed_function>"
                                 "</Coordinate></coordinates>")),
         "m:10: the prescribed motion of coordinate 'q' is a function of time: it stands where "
         "that begins, at 0.5"},
        {DOCUMENT(SET("BodySet", "<Body name=\"b\"/>\n")
                      SET("JointSet", "<CantileverFreeBeamJoint name=\"e\"><socket_parent_frame>"
                                      "ground</socket_parent_frame><socket_child_frame>b"
                                      "</socket_child_frame></CantileverFreeBeamJoint>\n")),
         "m:7: CantileverFreeBeamJoint 'e': it is held rigid"},
        {AXIS("<coordinates>q r</coordinates><axis>1 0 0</axis>"),
         "m:8: rotation1 of joint 'j' depends on several coordinates (q r)"},
        {AXIS("<coordinates>q</coordinates><axis>1 0 0</axis><Sine/>"),
         "m:8: function <Sine> of rotation1 of joint 'j': what it gives stays at 0"},
        {DOCUMENT(ARM "<SmoothSphere/>\n"), "m:12: element <SmoothSphere>: left out"},
        {DOCUMENT(ARM "<ForceSet file=\"f.xml\"/>\n"), "m:12: <ForceSet> kept in another file"},
        {DOCUMENT(ARM "<BodySet/>\n"), "m:12: a second <BodySet>: left out"},
        {"<OpenSimDocument Version=\"40000\">\n<Model name=\"a\">\n" ARM
         "</Model>\n<Model name=\"b\"/></OpenSimDocument>\n",
         "m:13: a second <Model> 'b': left out"},
        {DOCUMENT(ARM_WITH("<WrapObjectSet><objects><WrapCone name=\"elbow\"/></objects>"
                           "</WrapObjectSet>\n",
                           "") SET("ForceSet",
                                   MUSCLE_WITH("Thelen2003Muscle", POINTS, WRAP("elbow"), F100))),
         "m:15: muscle 'm' goes straight past the WrapCone 'elbow'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_description *d = NULL;
        mhe_error err = {0};
        if (mhi_osim_parse("m", cases[i].text, strlen(cases[i].text), &d, &err) != MHE_OK) {
            fail_msg("%s", err.text);
        }
        assert_string_equal(d->unsupported[0], cases[i].unsupported);
        if (d->n_unsupported != 1) {
            fail_msg("%s, and %s", d->unsupported[0], d->unsupported[1]);
        }
        mhi_description_free(d);
    }
}

#define COORDINATE(content)                                                                \
    DOCUMENT(ARM_WITH("\n", "<coordinates><Coordinate name=\"q\">" content "</Coordinate>" \
                            "</coordinates>"))

/* What OpenSim goes on with, but a user may not have meant. */
static void what_is_gone_on_with_is_told(void **state) {
    (void)state;
    const struct {
        const char *text, *warning;
    } cases[] = {
        {COORDINATE("<default_value>5</default_value><range>0 2</range>"),
         "m:10: coordinate 'q' has the default 5, which its range of 0 to 2 excludes"},
        {COORDINATE("<range>-90 90</range>"),
         "m:10: coordinate 'q': its range is taken as -90 to 90 rad; is it in degrees?"},
        {DOCUMENT(
             ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                             POINTS CONDITIONAL("j_coord_0", "-90 45"), "", F100))),
         "m:15: ConditionalPathPoint 'c' of muscle 'm': its range is taken as -90 to 45 rad; is it "
         "in degrees?"},
        {DOCUMENT(ARM SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle",
                                                  POINTS CONDITIONAL("j_coord_0", ""), "", F100))),
         "m:15: ConditionalPathPoint 'c' of muscle 'm' has no range: as in OpenSim it is there at "
         "0 "
         "alone"},
        {DOCUMENT(ARM MARKER("/bodyset/arm", "0 -290 0")),
         "m:13: marker 'M' lies 290 m from its frame; is it in mm?"},
        {DOCUMENT(ARM_WITH("<mass_center>0 -150 0</mass_center>\n", "")),
         "m:4: the mass centre of body 'arm' lies 150 m from its frame; is it in mm?"},
        {DOCUMENT("<length_units>inch</length_units>\n" ARM),
         "m:3: <length_units> is 'inch': as in OpenSim the numbers are taken as m"},
        {"<OpenSimDocument Version=\"four\"><Model name=\"a\">\n" ARM "</Model></OpenSimDocument>",
         "m:1: Version=\"four\" is no version of OpenSim (20302, 30000, 40000 or the like)"},
        {"<OpenSimDocument Version=\"60000\"><Model name=\"a\">\n" ARM "</Model></OpenSimDocument>",
         "m:1: Version=\"60000\" is newer than what is known here (below 50000)"},
        {DOCUMENT(ARM_WITH("<WrapObjectSet><objects><WrapSphere name=\"w\"><radius>0.1</radius>"
                           "</WrapSphere>\n<WrapSphere name=\"w\"><radius>0.2</radius></WrapSphere>"
                           "</objects></WrapObjectSet>",
                           "")
                      SET("ForceSet", MUSCLE_WITH("Thelen2003Muscle", POINTS, WRAP("w"), F100))),
         "m:7: wrap object 'w' is there twice: paths take the first, in line 6"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_description *d = NULL;
        mhe_error err = {0};
        if (mhi_osim_parse("m", cases[i].text, strlen(cases[i].text), &d, &err) != MHE_OK) {
            fail_msg("%s", err.text);
        }
        int32_t at = 0;
        while (at < d->n_warnings && strcmp(d->warnings[at], cases[i].warning) != 0) {
            at++;
        }
        if (at == d->n_warnings) {
            fail_msg("'%s' is not told, but %s", cases[i].warning,
                     at > 0 ? d->warnings[0] : "nothing");
        }
        mhi_description_free(d);
    }
}

static void what_does_nothing_is_not_listed(void **state) {
    (void)state;
    const char *text = DOCUMENT(
        "<credits>x</credits><VisibleObject/><ProbeSet file=\"\"/><ControllerSet "
        "file=\"\"/>" ARM_WITH("<WrapObjectSet><objects><WrapCylinder name=\"w\"/>"
                               "</objects></WrapObjectSet>\n",
                               "")
            SET("ConstraintSet", "<WeldConstraint name=\"c\"><isEnforced>false</isEnforced>"
                                 "</WeldConstraint>\n")
                SET("ContactGeometrySet", "<ContactSphere name=\"s\"/>\n"));
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_osim_parse("m", text, strlen(text), &d, &err), MHE_OK);
    assert_int_equal(d->n_unsupported + d->n_warnings, 0);
    mhi_description_free(d);
}

static void files_are_told_apart_by_content(void **state) {
    (void)state;
    const struct {
        const char *name, *text;
        int ok;
    } files[] = {
        {"model_xml.bioMod", "\xef\xbb\xbf <OpenSimDocument><Model/></OpenSimDocument>", 1},
        {"model_text.osim", "version 3\nsegment A\nendsegment\n", 1},
        {"model_empty.osim", "", 0}};
    char path[1024];
    mhe_description *d = NULL;
    mhe_error err = {0};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        (void)snprintf(path, sizeof path, "%s/tests/%s", MHE_TEST_BINARY_DIR, files[i].name);
        FILE *stream = fopen(path, "wb");
        assert_non_null(stream);
        (void)fputs(files[i].text, stream);
        (void)fclose(stream);
        mhe_status status = mhi_model_read(path, &d, &err);
        assert_int_equal(status, files[i].ok ? MHE_OK : MHE_E_INPUT);
        mhi_description_free(d);
        (void)remove(path);
    }
    assert_int_equal(mhi_model_read("/nowhere/arm.osim", &d, &err), MHE_E_INPUT);
    assert_null(d);
    assert_non_null(strstr(err.text, "/nowhere/arm.osim"));
}

/* Each frame fixed to the next; they used to be followed to the end of the stack. */
static void long_chain_of_frames(void **state) {
    (void)state;
    enum { N = 200, EACH = 128 };
    char *text = malloc(N * EACH + 1024);
    assert_non_null(text);
    size_t at = (size_t)sprintf(text, "<OpenSimDocument><Model name=\"test\">\n<components>\n");
    for (int i = 0; i < N; i++) {
        at +=
            (size_t)sprintf(text + at,
                            "<PhysicalOffsetFrame name=\"f%d\"><socket_parent>/f%d</socket_parent>"
                            "</PhysicalOffsetFrame>\n",
                            i, i + 1);
    }
    (void)sprintf(text + at, "</components>\n%s</Model></OpenSimDocument>\n",
                  MARKER("/f0", "0 0 0"));
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_osim_parse("m", text, strlen(text), &d, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "m:103: frame '/f100': more than 100 frames fixed to each other");
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(mistakes_are_named_with_their_line),
                                       cmocka_unit_test(frames_and_bodies_in_a_circle),
                                       cmocka_unit_test(unsupported_things_are_named),
                                       cmocka_unit_test(what_is_gone_on_with_is_told),
                                       cmocka_unit_test(what_does_nothing_is_not_listed),
                                       cmocka_unit_test(files_are_told_apart_by_content),
                                       cmocka_unit_test(long_chain_of_frames)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
