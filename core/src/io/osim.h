/* SPDX-License-Identifier: Apache-2.0 */
/* osim.h: shared between the parts of the .osim reader. */
#ifndef MHI_OSIM_H
#define MHI_OSIM_H

#include "io/description_builder.h"

#include <libxml/tree.h>

/* A frame fixed to another: PhysicalOffsetFrame. */
typedef struct mhi_osim_frame {
    const char *path;   /* "/jointset/elbow/base_offset" */
    const char *owner;  /* "/jointset/elbow" */
    const char *parent; /* socket, as in the file */
    mhi_transform in_parent;
    int32_t line;
    int32_t visiting; /* a chain that comes back here is a loop */
} mhi_osim_frame;

typedef struct mhi_osim {
    mhi_builder b;
    xmlNode *model;
    mhi_list frames; /* mhi_osim_frame */
    int32_t depth;   /* of frames fixed to frames, while one is looked up */
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
/* The attribute "name", "" where it has none. */
const char *mhi_xml_name(mhi_osim *o, const xmlNode *node);
/* Text of an element without blanks at its ends; "" for NULL. */
const char *mhi_xml_text(mhi_osim *o, const xmlNode *node);
/* Text of a property; NULL where it is absent or empty. */
const char *mhi_xml_word(mhi_osim *o, xmlNode *object, const char *name);
/* Reads exactly n finite numbers of a property; 0: absent (out is left alone) or an error. */
int32_t mhi_xml_numbers(mhi_osim *o, xmlNode *object, const char *name, double *out, int32_t n);
/* All numbers of an element, counted; NULL with count 0 after an error. */
double *mhi_xml_all_numbers(mhi_osim *o, const xmlNode *node, int32_t *count);
int32_t mhi_xml_flag(mhi_osim *o, xmlNode *object, const char *name); /* absent: 0 */
/* First object of a set of the model: <BodySet><objects><...; NULL: none. */
xmlNode *mhi_xml_objects(mhi_osim *o, xmlNode *parent, const char *set);

/* osim_frame.c: which body a socket means. */
void mhi_osim_frames(mhi_osim *o);
/* Path of the socket `name` ("parent_frame") of an object, in any spelling of 4.x; NULL: none. */
const char *mhi_osim_socket(mhi_osim *o, xmlNode *object, const char *name);
/* The body (NULL: ground) and the place in it that `socket` means to the object at `owner`. 0 after
 * an error. */
int32_t mhi_osim_resolve(mhi_osim *o, const char *socket, const char *owner, int32_t line,
                         const char **body, mhi_transform *in_body);
/* Location of a point or marker, v4 (socket and location) or before (body and location), brought to
 * the body; 0 after an error. */
int32_t mhi_osim_location(mhi_osim *o, xmlNode *object, const char **body, double location[3]);

/* osim_function.c: the function in a TransformAxis or MultiplierFunction: 1: read; 0: there is
 * none; -1: an error, or unsupported (then listed). `whose` names it in messages. */
int32_t mhi_osim_function(mhi_osim *o, xmlNode *holder, const char *whose, mhe_function *function);

/* osim_joint.c, osim_force.c */
void mhi_osim_bodies(mhi_osim *o);
void mhi_osim_joint(mhi_osim *o, xmlNode *joint, mhi_body_draft *body);
void mhi_osim_forces(mhi_osim *o);

#endif
