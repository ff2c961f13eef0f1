/* SPDX-License-Identifier: Apache-2.0 */
/* osim.h: shared between the parts of the .osim reader. */
#ifndef MHI_OSIM_H
#define MHI_OSIM_H

#include "io/description_builder.h"

#include <libxml/tree.h>

/* A frame fixed to another: PhysicalOffsetFrame, or StationDefinedFrame. */
typedef struct mhi_osim_frame {
    const char *path;   /* "/jointset/elbow/base_offset" */
    const char *owner;  /* "/jointset/elbow" */
    const char *parent; /* socket, as in the file */
    mhi_transform in_parent;
    xmlNode *landmarks; /* the element, where it stands on points; NULL: it has a parent */
    int32_t line;
    int32_t visiting; /* a chain that comes back here is a loop */
} mhi_osim_frame;

/* A point that a frame may stand on: Station, Marker. */
typedef struct mhi_osim_station {
    const char *path;
    xmlNode *node;
} mhi_osim_station;

typedef struct mhi_osim {
    mhi_builder b;
    xmlNode *model;
    mhi_list frames;   /* mhi_osim_frame */
    mhi_list stations; /* mhi_osim_station */
    int32_t depth;     /* of frames fixed to frames, while one is looked up */
    int32_t tidied;    /* the text is the second try */
} mhi_osim;

/* osim_xml.c: elements and their values. Names are those of tags; memory is the builder's. */
xmlNode *mhi_xml_first(xmlNode *parent); /* first child element; parent may be NULL */
xmlNode *mhi_xml_next(xmlNode *node);    /* next element beside it */
xmlNode *mhi_xml_child(xmlNode *parent, const char *name);
int32_t mhi_xml_is(const xmlNode *node, const char *name);
int32_t mhi_xml_line(const xmlNode *node);
/* The property `name` of an object: its own child, or that of its class in a <defaults> block
 * around it. NULL: neither. */
xmlNode *mhi_xml_property(xmlNode *object, const char *name);
/* An attribute; "" where it is absent. */
const char *mhi_xml_attribute(mhi_osim *o, const xmlNode *node, const char *name);
/* The attribute "name", "" where it has none. */
const char *mhi_xml_name(mhi_osim *o, const xmlNode *node);
/* Text of an element without blanks at its ends; "" for NULL. */
const char *mhi_xml_text(mhi_osim *o, const xmlNode *node);
/* Text of a property; NULL where it is absent or empty. */
const char *mhi_xml_word(mhi_osim *o, xmlNode *object, const char *name);
/* Reads exactly n finite numbers of a property; 0: absent (out is left alone) or an error. */
int32_t mhi_xml_numbers(mhi_osim *o, xmlNode *object, const char *name, double *out, int32_t n);
/* The same for two bounds, which may be infinite. */
int32_t mhi_xml_range(mhi_osim *o, xmlNode *object, const char *name, double out[2]);
int32_t mhi_xml_bound(mhi_osim *o, xmlNode *object, const char *name, double *out); /* one */
/* All numbers of an element, counted; NULL with count 0 after an error. */
double *mhi_xml_all_numbers(mhi_osim *o, const xmlNode *node, int32_t *count);
int32_t mhi_xml_flag(mhi_osim *o, xmlNode *object, const char *name); /* absent: 0 */
/* -1: absent */
int32_t mhi_xml_stated_flag(mhi_osim *o, xmlNode *object, const char *name);
/* First object of a set of the model: <BodySet><objects><...; NULL: none. */
xmlNode *mhi_xml_objects(xmlNode *parent, const char *set);
/* 1 where the tag ends so. */
int32_t mhi_xml_ends(const xmlNode *node, const char *ending);
/* The elements of a set of the model, then those that stand free among its <components>. */
typedef struct mhi_osim_walk {
    mhi_osim *o;
    const char *set;
    const char *owner; /* path of what holds the element: "/bodyset", "" for the model */
    xmlNode *node;     /* NULL: there is none left */
    int32_t place;
} mhi_osim_walk;
mhi_osim_walk mhi_osim_begin(mhi_osim *o, const char *set);
xmlNode *mhi_osim_next(mhi_osim_walk *walk);
/* 1 where the tag is one of the n names. */
int32_t mhi_xml_one_of(const xmlNode *node, const char *const *names, size_t n);
/* 0 where a force or constraint says that it is switched off, in any version's words. */
int32_t mhi_xml_enabled(mhi_osim *o, xmlNode *object);

/* osim_tidy.c: the file as OpenSim's own parser reads it, without comments, "&" that begins no
 * entity spelt out. 0: there is nothing to mend. text is the caller's to free; NULL: no memory. */
typedef struct mhi_osim_tidied {
    char *text;
    size_t length;
    int32_t plain_line, comment_line; /* the first "&" and comment that are mended; 0: none */
} mhi_osim_tidied;
int32_t mhi_osim_tidy(const char *text, size_t length, mhi_osim_tidied *tidied);

/* osim_frame.c: which body a socket means. */
void mhi_osim_frames(mhi_osim *o);
/* Path of the socket `name` ("parent_frame") of an object, in any spelling of 4.x; NULL: none. */
const char *mhi_osim_socket(mhi_osim *o, xmlNode *object, const char *name);
/* The body (NULL: ground) and the place in it that `socket` means to the object at `owner`. 0 after
 * an error. */
int32_t mhi_osim_resolve(mhi_osim *o, const char *socket, const char *owner, int32_t line,
                         const char **body, mhi_transform *in_body);
/* "../ground" seen from "/jointset/elbow" -> "/jointset/ground"; an absolute path as it is. */
const char *mhi_osim_absolute(mhi_osim *o, const char *socket, const char *owner);
/* osim_landmark.c: the body and the place in it of a frame that stands on points. 0 after an error.
 */
int32_t mhi_osim_landmark_frame(mhi_osim *o, const mhi_osim_frame *frame, const char **body,
                                mhi_transform *in_body);
/* Location of a point or marker, v4 (socket and location) or before (body and location), brought to
 * the body; 0 after an error. */
int32_t mhi_osim_location(mhi_osim *o, xmlNode *object, const char **body, double location[3]);
/* The two frames that a force or constraint of the set `set` ("/forceset") joins: sockets
 * `socket`1, `socket`2, before 4.0 `before`1 with location_ and orientation_`before`1. 0 after an
 * error. */
int32_t mhi_osim_two_frames(mhi_osim *o, xmlNode *object, const char *set, const char *socket,
                            const char *before, const char *body[2], mhi_transform frame[2]);

/* osim_function.c: the function in a TransformAxis or MultiplierFunction: 1: read; 0: there is
 * none; -1: an error, or unsupported (then listed). `whose` names it in messages. */
int32_t mhi_osim_function(mhi_osim *o, xmlNode *holder, const char *whose, mhe_function *function);
/* The function that is the property `name` of an object: in an element of that tag, or an element
 * with it as its attribute "name". */
int32_t mhi_osim_function_of(mhi_osim *o, xmlNode *object, const char *name, const char *whose,
                             mhe_function *function);

/* osim_joint.c, osim_coordinate.c, osim_ellipsoid.c */
void mhi_osim_bodies(mhi_osim *o);
void mhi_osim_joints(mhi_osim *o);
/* Coordinates of a joint: numbers [first, first + n) of the builder's. */
typedef struct mhi_osim_joint {
    xmlNode *node;
    const char *name;
    mhi_body_draft *body;
    int32_t first, n;
} mhi_osim_joint;
/* The joint's own coordinates, filled up to n with OpenSim's names for those not listed. */
void mhi_osim_coordinates(mhi_osim *o, mhi_osim_joint *j, int32_t n);
/* The motion of the joint's coordinate i by itself. */
void mhi_osim_motion(mhi_osim *o, mhi_osim_joint *j, int32_t kind, int32_t i, const double axis[3]);
/* Number of the coordinate that `name` (a name, or a path that ends in one) means to `whose`; -1
 * after an error. */
int32_t mhi_osim_coordinate(mhi_osim *o, const char *name, int32_t line, const char *whose);
void mhi_osim_ellipsoid_joint(mhi_osim *o, mhi_osim_joint *j);
void mhi_osim_scapulothoracic_joint(mhi_osim *o, mhi_osim_joint *j);

/* osim_constraint.c: couplers and loops; osim_wrap.c: what paths wrap around. */
void mhi_osim_constraints(mhi_osim *o);
void mhi_osim_obstacles(mhi_osim *o);

/* osim_path.c: the path of a muscle, ligament or spring; 0: there is none left, or an error. */
int32_t mhi_osim_path(mhi_osim *o, xmlNode *object, const char *what, mhi_path_draft *out);

/* osim_muscle.c, osim_force.c */
int32_t mhi_osim_is_muscle(const xmlNode *node);
void mhi_osim_muscle(mhi_osim *o, xmlNode *node);
void mhi_osim_forces(mhi_osim *o);
/* A force or muscle wherever it stands; 0: this is none that is known. */
int32_t mhi_osim_force(mhi_osim *o, xmlNode *node);

#endif
