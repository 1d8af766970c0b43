/* rodmodel core: a calibrated Cosserat rod of a soft pneumatic actuator, in C99.
 *
 * The library computes the pose of an actuator's tip under three chamber pressures and loads, its derivatives, and
 * the pressures that bring the tip to a target. It allocates no memory, keeps no state, accesses no file, and bounds
 * every iteration. Any number of threads may call it at once, each with its own workspace.
 *
 * Units are SI: m, N, Pa, rad. The base is at the origin and the rod points along +z at rest, chamber k at azimuth
 * 120 deg (k - 1), chamber 1 on +x; `base_position` and `base_rotation` move it. Vectors are three numbers, rotation
 * matrices nine, by rows, with the directors d1, d2, d3 as columns. "World" is the frame in which the base is given,
 * "body" the frame of a section.
 *
 * The order of calls:
 *
 *     static rm_real workspace[...];                     at least rm_workspace_size(&rod, steps, jacobian)
 *     rm_input input = {0};                              no pressure, no load
 *     rm_options options;   rm_default_options(&options);
 *     rm_solution solution;
 *     input.pressure[0] = 30e3;
 *     if (rm_solve(&rod, &input, &options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL) ... solution.tip_position
 *
 * A function writes its results in full, whatever it returns: for a bad input numbers are NaN and flags 0. With the
 * `unknown` of a nearby solution as `start`, a solve takes about half the time.
 *
 * Define RM_REAL_FLOAT for single precision. `rodmodel export` writes the `rm_rod` of a calibration as C constants.
 */
#ifndef RODMODEL_CORE_H
#define RODMODEL_CORE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef RM_REAL_FLOAT
typedef float rm_real;
#else
typedef double rm_real;
#endif

/* cffi: begin */

/* Result of a solve. */
enum rm_result {
    RM_SUCCESSFUL = 0,     /* the equilibrium under the full load was found, on the branch that starts at rest */
    RM_BAD_INPUT = 1,      /* a pressure below zero, a number above 1e300 (1e30 in single precision) or NaN, no rotation
                            * matrix, steps below 1, or a tolerance that is negative or above 0.01 rad */
    RM_UNSTABLE = 2,       /* the rod would snap or buckle before it carries the full load */
    RM_NOT_CONVERGED = 3,  /* Newton's method found no equilibrium on the branch that the rod follows from rest */
    RM_UNRESOLVED = 4,     /* the rod bends too sharply for so few steps: take more */
    RM_TOO_MANY_SHOTS = 5  /* the limit on iterations was met */
};

/* Used parts of an input; the others are absent, whatever their numbers. */
enum rm_given {
    RM_LOADS = 1,          /* tip_force, tip_moment, gravity, distributed_force, follower_moment */
    RM_FOLLOWER_FORCE = 2, /* follower_force: six unknowns in place of three */
    RM_BASE = 4            /* base_position and base_rotation */
};

/* Results of a solve beyond the tip. */
enum rm_ask {
    RM_VOLUMES = 1         /* chamber volumes: two to four more evaluations of the section */
};

/* Section law: a potential of curvature u and pressures p, a mean over the images of the section's symmetry. With
 * x = u/u_s, q = p/p_s and, for an image, h = (q[order], tanh(W q[order] + w)),
 *
 *     Pi = E [constant + slope.x + x.A x/2 + q.B x + q.C q/2 + sum_j c_j phi(d_j.x + b_j + e_j.h) + v.(h - h0)] - V0 sum p
 *     phi'(z) = (1 + z^2)^-2
 *
 * Ridges of all images are stored one after another; `ridges` is padded to a multiple of 8 with zero weights. */
typedef struct {
    int images;                     /* 1 to 6 */
    int ridges;                     /* number of ridges of one image */
    int features;
    int reserved;
    rm_real pressure_scale;         /* p_s [Pa] */
    rm_real curvature_scale;        /* u_s [1/m] */
    rm_real energy_scale;           /* E [N]: energy per length */
    rm_real rest_volume;            /* V0: chamber volume per length at rest [m^2] */
    rm_real constant;
    rm_real slope[3];
    rm_real quadratic[6];           /* A: entries 11, 12, 13, 22, 23, 33 */
    rm_real slope_by_pressure[9];   /* B, by rows of pressures */
    rm_real pressure_quadratic[9];  /* C, symmetric */
    const int *orders;              /* (images, 3): chamber, 0 to 2, of each pressure of an image */
    const rm_real *feature_weights; /* W: (features, 3) */
    const rm_real *feature_biases;  /* w: (images, features) */
    const rm_real *rest_features;   /* tanh(w): (images, features) */
    const rm_real *mixing;          /* e: (3 + features, ridges) */
    const rm_real *offsets;         /* b: (ridges) */
    const rm_real *weights;         /* c over the number of images: (images * ridges) */
    const rm_real *directions;      /* d in the axes of the rod: (3, images * ridges) */
    const rm_real *slopes;          /* v over the number of images: (3 + features) */
    const rm_real *guess;           /* (images, 3, 3 + features): free curvature x from h - h0, about */
} rm_law;

/* Dimensions [m], masses, and effects of the ends; the manual explains the latter. */
typedef struct {
    rm_real body_length;
    rm_real cap_length;
    rm_real mass_per_length;        /* [kg/m] */
    rm_real cap_mass;               /* [kg] */
    rm_real stiff_tip;              /* length before the cap that does not bend */
    rm_real base_turn;              /* turn of the first section by the pressures' moment [rad/Pa] */
    rm_real base_lag;               /* length whose free turn is subtracted from that of the base */
    rm_real base_stiffness;         /* bending stiffness for which both hold [N m^2]; 0: for any */
    rm_real base_growth;            /* growth of the base's reach with the softness of the section */
    rm_real tip_offset;             /* largest distance of the cap from the end of the arc */
    rm_real tip_offset_curvature;   /* curvature at which the distance is 71 % of the largest [1/m] */
    rm_real tip_draw;               /* nearness of the cap to the base per squared curvature [m^3] */
    rm_real held_length;            /* length over which chambers keep their volume */
    rm_real shear_compliance;       /* lean of a section per transverse force [1/N] */
} rm_actuator;

/* Loads inside which the law was calibrated. Each pressure and a share of the two others are together at most
 * `beside_max`; 0: no such limit. */
typedef struct {
    rm_real pressure_max[3];        /* largest pressure of each chamber [Pa] */
    rm_real pressure_sum_max;       /* largest sum of the pressures [Pa] */
    rm_real moment_max;             /* largest bending moment on a section [N m] */
    rm_real torque_max;             /* largest torque on a section [N m] */
    rm_real beside_share;
    rm_real beside_max;             /* [Pa] */
    rm_real pressure_min[3];        /* least pressure of each chamber, for a branch that ends below [Pa] */
    rm_real single_max[3];          /* largest pressure of a chamber alone, beyond the limits above; 0: none [Pa] */
    rm_real single_beside;          /* largest pressure of each of the others there [Pa] */
} rm_domain;

/* Bound that the errors of 90 % of states keep: a term over the sum of the pressures, one over the predicted bending
 * angle, and one in proportion to the moment that the loads put on the base. The first two are linear between nodes
 * and constant outside them. */
typedef struct {
    rm_real pressure_sum[8];        /* sums of the pressures at the nodes, increasing [Pa] */
    rm_real angle[8];               /* terms of the bending angle's bound at these nodes [rad] */
    rm_real tip[8];                 /* terms of the tip's bound at these nodes [m]; NaN where none is known */
    rm_real bending_angle[8];       /* bending angles at the nodes of the second term, increasing [rad] */
    rm_real angle_by_bend[8];       /* terms of the bending angle's bound at these nodes [rad] */
    rm_real tip_by_bend[8];         /* terms of the tip's bound at these nodes [m] */
    rm_real angle_per_moment;       /* growth with the moment on the base [rad/(N m)] */
    rm_real tip_per_moment;         /* [1/N] */
} rm_error_bound;

typedef struct {
    rm_law law;
    rm_actuator actuator;
    rm_domain domain;
    rm_error_bound error_bound;
} rm_rod;

/* Laws of all orientations psi of a winding; rm_orient returns the law of one. */
typedef struct {
    rm_law law;                        /* biases, rest features, constant and slope are not used */
    const rm_real *shared_biases;      /* (features) */
    const rm_real *orientation_weights; /* (features, 2): factors of cos 2 psi and sin 2 psi */
    const rm_real *image_signs;        /* (images): psi of an image is sign (psi - turn) */
    const rm_real *image_turns;        /* (images) [rad] */
    const rm_real *image_axes;         /* (images, 9): matrix from the rod's axes to the image's */
    const rm_real *bare_directions;    /* d in the image's axes: (3, ridges) */
    const rm_real *bare_weights;       /* c over the number of images: (ridges) */
} rm_oriented;

/* Branches of equilibria of one actuator. The first is that of loading, on which the section stands upright; on the
 * others a partition wall has snapped beside a chamber, the likeliest side of each chamber first. */
typedef struct {
    int count;
    const rm_rod *const *rods;      /* (count) */
    const int *chambers;            /* (count): number of the chamber, from 1; 0 on the loading branch */
    const int *sides;               /* (count): 1 towards larger bending planes gamma, -1 smaller; 0 likewise */
} rm_branches;

/* Pressures, loads and base. All zeros: a rod at rest. */
typedef struct {
    rm_real pressure[3];            /* gauge pressures [Pa], 0 or more */
    rm_real tip_force[3];           /* dead force at the centre of the cap's outer face, world [N] */
    rm_real tip_moment[3];          /* dead moment on the cap, world [N m] */
    rm_real gravity[3];             /* acceleration, world [m/s^2] */
    rm_real distributed_force[3];   /* dead force along the body, per length, world [N/m] */
    rm_real follower_force[3];      /* force at the centre of the cap's outer face, frame of the cap [N] */
    rm_real follower_moment[3];     /* moment on the cap, frame of the cap [N m] */
    rm_real base_position[3];       /* world [m] */
    rm_real base_rotation[9];
    int given;                      /* enum rm_given, or-ed */
    int reserved;
} rm_input;

typedef struct {
    rm_real tolerance;              /* tolerance of Newton's method on u L at the base [rad] */
    int steps;                      /* steps along the rod; the tip's error falls with their fourth power */
    int max_shots;                  /* largest number of integrations in a solve, which bounds its time */
    int ask;                        /* enum rm_ask, or-ed */
    int reserved;
} rm_options;

/* Equilibrium of a rod. */
typedef struct {
    rm_real tip_position[3];        /* centre of the cap's outer face [m] */
    rm_real tip_rotation[9];        /* frame of the cap */
    rm_real bend[2];                /* (theta cos gamma, theta sin gamma) [rad], smooth where the rod is straight */
    rm_real bending_angle;          /* theta, of the tip's tangent from the base's, continued past 180 deg [rad] */
    rm_real bending_plane;          /* gamma in [0, 2 pi); 0 for a straight rod [rad] */
    rm_real chamber_volume[3];      /* volumes over the body [m^3]; NaN without RM_VOLUMES */
    rm_real unknown[6];             /* u L at the base, then the follower force in the frame of the base: a start */
    rm_real free_curvature[3];      /* free curvature of the section at these pressures [1/m] */
    rm_real load_fraction;          /* fraction of the loads at which this is the equilibrium; 1 after success */
    rm_real moment_share;           /* largest moment on a section over that of the domain */
    rm_real base_moment;            /* norm of the moment on the first section [N m]; 0 without loads */
    rm_real angle_error;            /* the rod's bound of the angle's error here [rad]; NaN outside the domain */
    rm_real tip_error;              /* likewise of the tip's distance [m] */
    int result;                     /* enum rm_result */
    int stable;                     /* whether the second variation of the energy is positive */
    int in_domain;                  /* whether pressures, moments and forces are in the calibrated domain,
                                     * and the base turns by at most 0.5 rad */
    int load_steps;
    int shots;                      /* number of integrations from base to end */
    int steps;                      /* number of steps between the nodes: 1 for an arc */
} rm_solution;

/* A section at a step's end, frame of the base, before `mount`. */
typedef struct {
    rm_real position[3];            /* [m] */
    rm_real quaternion[4];          /* frame of the section, scalar first */
    rm_real turn[3];                /* u L, body frame */
    rm_real rate[3];                /* derivative of u L by s/L */
    rm_real drift[3];               /* shear part of r' */
} rm_node;

/* Derivatives by pressures [1/Pa], tip force [1/N], tip moment [1/(N m)] and gravity [s^2/m]: columns 0-2, 3-5, 6-8,
 * 9-11 of arrays by rows. A turn is the omega of dR = (omega x) R, world. */
typedef struct {
    rm_real position[36];           /* (3, 12) */
    rm_real turn[36];               /* (3, 12) */
    rm_real bend[24];               /* (2, 12) */
    rm_real bending_angle[12];      /* NaN for a straight rod, where the angle is not differentiable */
    rm_real bending_plane[12];      /* NaN for a straight rod */
} rm_jacobian;

/* Section at a curvature and pressures. */
typedef struct {
    rm_real energy;                 /* potential Pi per length [J/m] */
    rm_real moment[3];              /* dPi/du [N m] */
    rm_real stiffness[9];           /* d2Pi/du2 [N m^2] */
    rm_real volume[3];              /* -dPi/dp, per length [m^2] */
} rm_section;

/* Target of the inverse: a tip position, or a bend. */
typedef struct {
    rm_real point[3];               /* tip position [m]; or theta cos gamma, theta sin gamma [rad] */
    int is_bend;
    int reserved;
} rm_target;

typedef struct {
    rm_real pressure[3];            /* within the domain [Pa] */
    rm_real distance;               /* remaining distance to the target [m] or [rad] */
    rm_solution solution;           /* solution of the rod at these pressures */
    int reached;                    /* whether the target is met, to 0.15 % of the length or 1e-3 rad */
    int converged;                  /* whether the pressures are a local minimum of the distance */
    int nearest;                    /* whether a search over the whole domain found nothing nearer */
    int evaluations;                /* number of solves in the search */
} rm_inverse_result;

/* Return the size of a workspace for the functions below, in rm_real. */
size_t rm_workspace_size(const rm_rod *rod, int steps, int with_jacobian);

/* Check a rod's sizes and numbers: return 0, or RM_BAD_INPUT. The other functions do not check them. */
int rm_check_rod(const rm_rod *rod);

/* Set 8 steps, the tolerance 1e-10 (1e-5 in single precision), 512 shots, and no further results. */
void rm_default_options(rm_options *options);

/* Set the law of one orientation psi [rad]. `memory` stores its arrays, rm_orient_size(oriented) numbers, and must
 * live as long as the law. */
size_t rm_orient_size(const rm_oriented *oriented);
void rm_orient(const rm_oriented *oriented, rm_real psi, rm_real *memory, rm_law *law);

/* Solve for the equilibrium; return the solution's `result`. `start`: `unknown` of a nearby solution, which may be
 * `solution` itself, or NULL. If Newton's method finds no stable equilibrium from it, the solve restarts cold.
 * `nodes`: an array of steps + 1, or NULL. */
int rm_solve(const rm_rod *rod, const rm_input *input, const rm_options *options, const rm_real *start,
             rm_real *workspace, rm_node *nodes, rm_solution *solution);

/* Solve for many inputs, each without a start; return the number of successes. */
int rm_solve_batch(const rm_rod *rod, const rm_input *inputs, int count, const rm_options *options,
                   rm_real *workspace, rm_solution *solutions);

/* Solve, and differentiate the pose of the tip and of the sections at `count` arc lengths [m]: `positions` and `turns`
 * are (count, 3, 12). Needs a workspace with a Jacobian, and `nodes` if `count` is not 0. */
int rm_solve_with_jacobian(const rm_rod *rod, const rm_input *input, const rm_options *options,
                           const rm_real *start, rm_real *workspace, rm_node *nodes, rm_solution *solution,
                           rm_jacobian *jacobian, int count, const rm_real *arc_lengths, rm_real *positions,
                           rm_real *turns);

/* Evaluate pose and curvature of a solution at arc lengths s [m], from 0 at the base to the cap's outer face; NaN
 * beyond. Any result may be NULL: positions (count, 3), rotations (count, 9), curvatures (count, 3). */
void rm_stations(const rm_rod *rod, const rm_input *input, const rm_solution *solution, const rm_node *nodes,
                 int count, const rm_real *arc_lengths, rm_real *positions, rm_real *rotations,
                 rm_real *curvatures);

/* Evaluate the section law: free curvature at pressures, and the section at a curvature. Return 0, or RM_BAD_INPUT. */
int rm_free_curvature(const rm_rod *rod, const rm_real *pressure, rm_real *workspace, rm_real *curvature);
int rm_section_at(const rm_rod *rod, const rm_real *curvature, const rm_real *pressure, rm_real *workspace,
                  rm_section *section);

/* Find pressures in the domain, of single chambers to their own limits, that bring the rod to a target, with one
 * chamber at zero if the other two suffice; return the solution's `result`. The pressures of `input` are ignored.
 * Needs a workspace with a Jacobian. RM_BAD_INPUT for a target beyond 10 rod lengths or 10 rad, and for a rod of a
 * snapped branch, which has least pressures. */
int rm_inverse(const rm_rod *rod, const rm_target *target, const rm_input *input, const rm_options *options,
               rm_real *workspace, rm_inverse_result *result);

/* Find pressures for many targets, with one input for all or one for each; return the number of targets reached. */
int rm_inverse_batch(const rm_rod *rod, const rm_target *targets, const rm_input *inputs, int inputs_each,
                     int count, const rm_options *options, rm_real *workspace, rm_inverse_result *results);

/* Return the branch, an index of `rods`, under three pressures of an actuator that was on branch `before`; from rest, 0.
 * It stays on its branch to that branch's end. There it jumps: to the loading branch if that one has such a state, else
 * to that of the chamber with the largest pressure. If none has, it stays. A branch that is none counts as rest. */
int rm_branch_at(const rm_branches *branches, const rm_real *pressure, int before);

/* Return whether an actuator with another past may be on a branch of the other kind under these pressures. */
int rm_other_branch_possible(const rm_branches *branches, const rm_real *pressure, int branch);

/* cffi: end */

/* rm_workspace_size as a constant, for a static array. The workspace holds two arrays of features, seven numbers per
 * ridge, quadrature weights and two sets of nodes; with a Jacobian also the neighbouring solutions at the nodes and the
 * inverse's grid of pressures; and padding for alignment. */
#define RM_PAD (64 / sizeof(rm_real))
#define RM_PADDED(count) (((count) + RM_PAD - 1) / RM_PAD * RM_PAD)
#define RM_NODE_SIZE 16
#define RM_KEPT_SIZE 288
#define RM_EXPANSION_SIZE 22
/* Points of the inverse's grid along each axis. */
#define RM_GRID 8
/* Steps along the rod in the inverse's search under loads; its result is solved with the caller's steps. */
#define RM_SEARCH_STEPS 4
#define RM_NODES(steps, with_jacobian) (((with_jacobian) && (steps) < RM_SEARCH_STEPS ? RM_SEARCH_STEPS : (steps)) + 1)
#define RM_WORKSPACE_SIZE(images, ridges, features, steps, with_jacobian)                                             \
    (2 * RM_PADDED(3 + (features)) + 7 * (images) * (ridges) + RM_PADDED(RM_NODES(steps, with_jacobian))              \
     + (2 * RM_NODE_SIZE + 4 * RM_EXPANSION_SIZE) * RM_NODES(steps, with_jacobian)                                    \
     + ((with_jacobian) ? RM_KEPT_SIZE * RM_NODES(steps, with_jacobian) + RM_GRID * RM_GRID * RM_GRID : 0) + RM_PAD)

#ifdef __cplusplus
}
#endif

#endif
