/* Chipmunk's functions, out of pymunk's own library: bodies, joints and spaces are made by whoever fills the arrays. */
#ifndef KERNEL_PHYSICS_H
#define KERNEL_PHYSICS_H

typedef struct {
    double x, y;
} kernel_vector; /* Chipmunk's cpVect */

typedef struct { /* Chipmunk's functions */
    void (*space_step)(void *space, double period);
    kernel_vector (*position)(void *body);
    double (*angle)(void *body);
    kernel_vector (*rotation)(void *body); /* cosine and sine of its angle */
    kernel_vector (*velocity)(void *body);
    double (*spin)(void *body);
    void (*set_force)(void *body, kernel_vector force);
    void (*set_torque)(void *body, double torque);
    void (*apply_force)(void *body, kernel_vector force, kernel_vector point); /* both in the body's frame */
    void (*set_max_force)(void *joint, double force);
    void (*set_anchor_b)(void *joint, kernel_vector anchor);
} kernel_physics;

#endif
