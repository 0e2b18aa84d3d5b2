/* Convex outlines, and what sensors ask of them: how far, and how near to a bumper.
 * Everything is in the outline's own frame: metres, x forward, y left, origin at the centre of mass. */
#ifndef KERNEL_OUTLINE_H
#define KERNEL_OUTLINE_H

#include <stdint.h>

typedef struct {
    double x, y;             /* first corner */
    double along_x, along_y; /* unit tangent, counter-clockwise; the outward normal is (along_y, -along_x) */
    double length;
} kernel_edge;

typedef struct {
    uint32_t edges, corners;
    kernel_edge edge[16];
    double corner_x[16], corner_y[16];
    uint8_t has_disc;        /* a part is round: the arc from -half_angle to half_angle about the x axis */
    double disc_x, disc_radius, half_angle;
    double radius;           /* of the circle about the origin that holds everything */
} kernel_outline;

/* Distance of the nearest point that an eye at (x, y) sees; infinite for none. The cone: unit vectors along its left and
 * its right border (lx, ly, rx, ry). tangent: of the greatest angle between ray and normal. */
double outline_nearest_seen(const kernel_outline *outline, double x, double y, const double *cone, double tangent);

/* How far ahead of two strips, the left and the right of a middle line through (x, y) along the unit vector (fx, fy), the
 * nearest point of the outline is; infinite for none. span: least and greatest distance of a strip from that line. */
void outline_gaps(
    const kernel_outline *outline, double x, double y, double fx, double fy, const double *span, double *gaps);

#endif
