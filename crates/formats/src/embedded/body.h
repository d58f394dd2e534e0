/*
 * SUMMARY
 *
 * Written by flexbody beside the file of the numbers (layout version 1); docs/reference/formats/embedded.md describes both. C99 and C++11, freestanding: no
 * allocation, no library. A compiler may still call memcpy and memset, which every freestanding C has.
 *
 * The equations of motion of one flexible body (docs/theory.md section 6 and 7.4) with exactly the terms that the file holds:
 *
 *   Mc(q) nu' + h + (0, 0, K q + D qd) = (F, tau, Q),    nu = (V, omega, qd)
 *
 * V: velocity of the origin of the body frame, omega: angular velocity of the frame; all vectors are in body axes. q: modal coordinates.
 * F, tau (about the origin), Q: generalised forces that do the power F'V + tau'omega + Q'qd. Velocities, forces and accelerations have
 * FLEXBODY_VELOCITIES entries in this order: 3 + 3 + modes, of a plane body V_x, V_y, omega_z, modes. Vectors of a frame have 3 entries
 * also in the plane. V' is the rate of the components in body axes: the origin accelerates by V' + omega x V.
 *
 *   flexbody_evaluation e;                                       static, on the stack, one per state
 *   if (flexbody_open(&e, data, size) != FLEXBODY_OK) ...        once; checks the file
 *   flexbody_set(&e, q, nu);                                     everything below refers to this state
 *   flexbody_accelerations(&e, applied, acceleration);
 */
#ifndef FLEXBODY_H
#define FLEXBODY_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

/* SIZES */

/* Arrays that do not overlap: C99 has a word for it, compilers of C++ have their own. */
#if !defined(__cplusplus)
#define FLEXBODY_RESTRICT restrict
#elif defined(__GNUC__) || defined(_MSC_VER)
#define FLEXBODY_RESTRICT __restrict
#else
#define FLEXBODY_RESTRICT
#endif

/* Rows of the array `linear`. */
#define FLEXBODY_PAIRS (FLEXBODY_AXES == 3 ? 6 : 1)
#define FLEXBODY_ROW_W1 (FLEXBODY_TRANSLATIONS * FLEXBODY_AXES)
#define FLEXBODY_ROW_C1 (FLEXBODY_ROW_W1 + (FLEXBODY_HAS_W1 ? FLEXBODY_PAIRS : 0))

#define FLEXBODY_RIGID (FLEXBODY_TRANSLATIONS + FLEXBODY_AXES)
#define FLEXBODY_VELOCITIES (FLEXBODY_RIGID + FLEXBODY_MODES)

/* The data must start at a multiple of this; multiples of 64 put every array on its own cache lines. */
#define FLEXBODY_ALIGNMENT 8

/* The file holds binary64 or binary32 of IEEE 754. */
typedef char flexbody_number_check[sizeof(flexbody_real) == FLEXBODY_PRECISION && FLT_RADIX == 2 ? 1 : -1];

/* What functions return. */
enum {
    FLEXBODY_OK = 0,
    FLEXBODY_TOO_SHORT = 1,            /* fewer bytes than the file has */
    FLEXBODY_NOT_ALIGNED = 2,          /* the data does not start at a multiple of FLEXBODY_ALIGNMENT */
    FLEXBODY_NO_BODY = 3,              /* other data */
    FLEXBODY_BYTE_ORDER = 4,           /* this machine is not little-endian */
    FLEXBODY_OTHER_VERSION = 5,        /* of the layout */
    FLEXBODY_OTHER_BODY = 6,           /* sizes, terms or precision are not those of this header */
    FLEXBODY_DAMAGED = 7,              /* the checksum differs, or indices lead nowhere */
    FLEXBODY_NOT_POSITIVE_DEFINITE = 8, /* terms were dropped and the deformation is too large, or the state is no finite numbers */
    FLEXBODY_NO_FRAME = 9,             /* no frame has this index */
    FLEXBODY_NO_ORIENTATION = 10       /* the modes know no rotation of this frame */
};

/* The equations at one state. Members may be read after flexbody_set. */
typedef struct {
    const unsigned char *data;
    flexbody_real q[FLEXBODY_MODES];
    flexbody_real qd[FLEXBODY_MODES];
    flexbody_real velocity[3];             /* V */
    flexbody_real omega[3];
    flexbody_real first_moment[3];         /* s(q) = c + C1 q, with what geometric stiffness adds */
    flexbody_real inertia[9];              /* I(q) about the origin, row-major */
    flexbody_real lever[9];                /* -c~ + W0 Q: linear momentum per angular velocity, row-major */
    flexbody_real coupling[FLEXBODY_RIGID][FLEXBODY_MODES]; /* [C1(q); C(q)] */
    flexbody_real linear_momentum[3];      /* p */
    flexbody_real angular_momentum[3];     /* h, about the origin */
    flexbody_real velocity_forces[FLEXBODY_VELOCITIES]; /* h of the equations */
    flexbody_real modal[FLEXBODY_MODES];   /* from here on work space */
#if FLEXBODY_HAS_W2
    flexbody_real w2_q[FLEXBODY_STRIDE_W2];
#endif
#if FLEXBODY_HAS_W3
    flexbody_real w3_q[FLEXBODY_STRIDE_W3];
    flexbody_real w3_qd[FLEXBODY_STRIDE_W3];
#endif
#if FLEXBODY_HAS_W3_SKEW
    flexbody_real skew_qd[FLEXBODY_STRIDE_W3_SKEW];
#endif
#if FLEXBODY_HAS_ACCELERATION
    flexbody_real acceleration_q[FLEXBODY_STRIDE_ACCELERATION];
    flexbody_real acceleration_qd[FLEXBODY_STRIDE_ACCELERATION];
#endif
#if FLEXBODY_HAS_MODAL_MASS
    flexbody_real whitened[FLEXBODY_RIGID][FLEXBODY_MODES]; /* L^-1 of each row of the coupling */
#endif
} flexbody_evaluation;

/* Axes of rotation, and of each pair. */
#if FLEXBODY_AXES == 3
static const unsigned char flexbody_axis[3] = {0, 1, 2};
static const unsigned char flexbody_pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
#else
static const unsigned char flexbody_axis[1] = {2};
static const unsigned char flexbody_pair[1][2] = {{2, 2}};
#endif

/* An array of the file, in place. */
#define FLEXBODY_ARRAY(e, name) ((const flexbody_real *)(const void *)((e)->data + FLEXBODY_OFFSET_##name))
#define FLEXBODY_PARTS(e) ((const int32_t *)(const void *)((e)->data + FLEXBODY_OFFSET_FRAME_PARTS))

/* ---- the file ---- */

static inline uint32_t flexbody_u32(const unsigned char *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* CRC-32 with the reflected polynomial 0xEDB88320, four bits at a time. */
static inline uint32_t flexbody_checksum(const unsigned char *data, size_t size)
{
    static const uint32_t table[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};
    uint32_t crc = 0xFFFFFFFF;
    for (size_t i = 0; i < size; ++i) {
        crc ^= data[i];
        crc = crc >> 4 ^ table[crc & 15];
        crc = crc >> 4 ^ table[crc & 15];
    }
    return ~crc;
}

/* Whether the indices of every frame lead into the arrays. */
static inline int flexbody_frames_sound(const flexbody_evaluation *e)
{
#if FLEXBODY_FRAMES > 0
    const int32_t *parts = FLEXBODY_PARTS(e);
    for (size_t i = 0; i < FLEXBODY_FRAMES; ++i, parts += 3) {
        int32_t matrices = 0;
        for (int bit = 0; bit < 6; ++bit)
            matrices += parts[2] >> bit & 1;
        if (parts[0] < -1 || parts[0] >= FLEXBODY_ROTATIONS || parts[1] < 0 || parts[1] > FLEXBODY_SECONDS - matrices)
            return 0;
    }
#endif
    (void)e;
    return 1;
}

/* Takes `size` bytes at `data` as the numbers of the body, if they are. They are read in place and must stay. */
static inline int flexbody_open(flexbody_evaluation *e, const void *data, size_t size)
{
    static const unsigned char magic[8] = {'F', 'L', 'E', 'X', 'B', 'O', 'D', 'Y'};
    static const uint32_t expected[] = {FLEXBODY_HEADER};
    static const uint32_t arrays[] = {FLEXBODY_TABLE};
    const unsigned char *bytes = (const unsigned char *)data;
    const uint32_t mark = 0x01020304;
    if (size < FLEXBODY_BYTES)
        return FLEXBODY_TOO_SHORT;
    if ((uintptr_t)data % FLEXBODY_ALIGNMENT != 0)
        return FLEXBODY_NOT_ALIGNED;
    for (size_t i = 0; i < 8; ++i)
        if (bytes[i] != magic[i])
            return FLEXBODY_NO_BODY;
    for (size_t i = 0; i < 4; ++i)
        if (bytes[FLEXBODY_AT_BYTE_ORDER + i] != ((const unsigned char *)&mark)[i])
            return FLEXBODY_BYTE_ORDER;
    if (flexbody_u32(bytes + FLEXBODY_AT_VERSION) != FLEXBODY_LAYOUT)
        return FLEXBODY_OTHER_VERSION;
    if (flexbody_u32(bytes + FLEXBODY_AT_SIZE) != FLEXBODY_BYTES)
        return FLEXBODY_OTHER_BODY;
    for (size_t i = 0; i < sizeof expected / sizeof *expected; ++i)
        if (flexbody_u32(bytes + FLEXBODY_AT_PRECISION + 4 * i) != expected[i])
            return FLEXBODY_OTHER_BODY;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        if (flexbody_u32(bytes + FLEXBODY_AT_TABLE + 4 * i) != arrays[i])
            return FLEXBODY_OTHER_BODY;
    e->data = bytes;
    if (flexbody_u32(bytes + FLEXBODY_AT_CHECKSUM)
            != flexbody_checksum(bytes + FLEXBODY_CHECKED_FROM, FLEXBODY_BYTES - FLEXBODY_CHECKED_FROM)
        || !flexbody_frames_sound(e))
        return FLEXBODY_DAMAGED;
    return FLEXBODY_OK;
}

/* ---- kernels ---- */

/* y = A x of an array with nf columns. */
static inline void flexbody_product(size_t stride, const flexbody_real *FLEXBODY_RESTRICT a, const flexbody_real *FLEXBODY_RESTRICT x,
                                    flexbody_real *FLEXBODY_RESTRICT y)
{
    for (size_t i = 0; i < stride; ++i)
        y[i] = 0;
#if FLEXBODY_MODES >= 4
    /* Four columns at a time: y is loaded and stored a fourth as often. */
    for (size_t j = 0; j + 4 <= FLEXBODY_MODES; j += 4, a += 4 * stride) {
        const flexbody_real x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];
        for (size_t i = 0; i < stride; ++i)
            y[i] += (a[i] * x0 + a[stride + i] * x1) + (a[2 * stride + i] * x2 + a[3 * stride + i] * x3);
    }
#endif
#if FLEXBODY_MODES % 4
    for (size_t j = FLEXBODY_MODES - FLEXBODY_MODES % 4; j < FLEXBODY_MODES; ++j, a += stride)
        for (size_t i = 0; i < stride; ++i)
            y[i] += a[i] * x[j];
#endif
}

/* a'b of n numbers, in four sums that a compiler may keep in a vector register. */
static inline flexbody_real flexbody_dot(size_t n, const flexbody_real *FLEXBODY_RESTRICT a, const flexbody_real *FLEXBODY_RESTRICT b)
{
    flexbody_real s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    const size_t whole = n - n % 4;
    for (size_t i = 0; i < whole; i += 4) {
        s0 += a[i] * b[i];
        s1 += a[i + 1] * b[i + 1];
        s2 += a[i + 2] * b[i + 2];
        s3 += a[i + 3] * b[i + 3];
    }
    for (size_t i = whole; i < n; ++i)
        s0 += a[i] * b[i];
    return (s0 + s2) + (s1 + s3);
}

/* y += factor x of nf numbers. */
static inline void flexbody_add(flexbody_real factor, const flexbody_real *FLEXBODY_RESTRICT x, flexbody_real *FLEXBODY_RESTRICT y)
{
    for (size_t i = 0; i < FLEXBODY_MODES; ++i)
        y[i] += factor * x[i];
}

/* y += a x b. */
static inline void flexbody_add_cross(const flexbody_real a[3], const flexbody_real b[3], flexbody_real y[3])
{
    y[0] += a[1] * b[2] - a[2] * b[1];
    y[1] += a[2] * b[0] - a[0] * b[2];
    y[2] += a[0] * b[1] - a[1] * b[0];
}

static inline flexbody_real flexbody_dot3(const flexbody_real a[3], const flexbody_real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* 3 x 3 matrices are row-major: a += factor v~, the matrix of v x. */
static inline void flexbody_add_skew(flexbody_real factor, const flexbody_real v[3], flexbody_real a[9])
{
    a[1] -= factor * v[2];
    a[2] += factor * v[1];
    a[3] += factor * v[2];
    a[5] -= factor * v[0];
    a[6] -= factor * v[1];
    a[7] += factor * v[0];
}

/* y += A x, or A'x. */
static inline void flexbody_add_product3(const flexbody_real a[9], const flexbody_real x[3], flexbody_real y[3])
{
    for (size_t i = 0; i < 3; ++i)
        y[i] += flexbody_dot3(a + 3 * i, x);
}

static inline void flexbody_add_transposed3(const flexbody_real a[9], const flexbody_real x[3], flexbody_real y[3])
{
    for (size_t i = 0; i < 3; ++i)
        y[i] += a[i] * x[0] + a[3 + i] * x[1] + a[6 + i] * x[2];
}

/* Adds at both places of a pair in a symmetric matrix. */
static inline void flexbody_add_pair(size_t pair, flexbody_real value, flexbody_real a[9])
{
    const size_t i = flexbody_pair[pair][0], j = flexbody_pair[pair][1];
    a[3 * i + j] += value;
    if (i != j)
        a[3 * j + i] += value;
}

/* Entries of a vector of rigid motions and modes, of rotation about missing axes 0. */
static inline void flexbody_split(const flexbody_real *of_nu, flexbody_real linear[3], flexbody_real angular[3])
{
    for (size_t k = 0; k < 3; ++k)
        linear[k] = angular[k] = 0;
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        linear[k] = of_nu[k];
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        angular[flexbody_axis[a]] = of_nu[FLEXBODY_TRANSLATIONS + a];
}

/* The other way, added. */
static inline void flexbody_add_rigid(const flexbody_real linear[3], const flexbody_real angular[3], flexbody_real *of_nu)
{
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        of_nu[k] += linear[k];
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        of_nu[FLEXBODY_TRANSLATIONS + a] += angular[flexbody_axis[a]];
}

/* y += factor K q. */
static inline void flexbody_add_stiffness(const flexbody_evaluation *e, flexbody_real factor, flexbody_real *FLEXBODY_RESTRICT y)
{
    const flexbody_real *FLEXBODY_RESTRICT k = FLEXBODY_ARRAY(e, STIFFNESS);
#if FLEXBODY_COLUMNS_STIFFNESS == 1
    for (size_t i = 0; i < FLEXBODY_MODES; ++i)
        y[i] += factor * (k[i] * e->q[i]);
#else
    flexbody_real product[FLEXBODY_STRIDE_STIFFNESS];
    flexbody_product(FLEXBODY_STRIDE_STIFFNESS, k, e->q, product);
    flexbody_add(factor, product, y);
#endif
}

/* y += factor D qd. */
static inline void flexbody_add_damping(const flexbody_evaluation *e, flexbody_real factor, flexbody_real *FLEXBODY_RESTRICT y)
{
#if FLEXBODY_HAS_DAMPING && FLEXBODY_COLUMNS_DAMPING == 1
    const flexbody_real *FLEXBODY_RESTRICT d = FLEXBODY_ARRAY(e, DAMPING);
    for (size_t i = 0; i < FLEXBODY_MODES; ++i)
        y[i] += factor * (d[i] * e->qd[i]);
#elif FLEXBODY_HAS_DAMPING
    flexbody_real product[FLEXBODY_STRIDE_DAMPING];
    flexbody_product(FLEXBODY_STRIDE_DAMPING, FLEXBODY_ARRAY(e, DAMPING), e->qd, product);
    flexbody_add(factor, product, y);
#else
    (void)e;
    (void)factor;
    (void)y;
#endif
}

/* y += C1(q)'linear + C(q)'angular + m_ff modal. */
static inline void flexbody_add_modal_inertia(const flexbody_evaluation *e, const flexbody_real linear[3], const flexbody_real angular[3],
                                              const flexbody_real *modal, flexbody_real *FLEXBODY_RESTRICT y)
{
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        flexbody_add(linear[k], e->coupling[k], y);
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        flexbody_add(angular[flexbody_axis[a]], e->coupling[FLEXBODY_TRANSLATIONS + a], y);
#if FLEXBODY_HAS_MODAL_MASS
    flexbody_real product[FLEXBODY_STRIDE_MODAL_MASS];
    flexbody_product(FLEXBODY_STRIDE_MODAL_MASS, FLEXBODY_ARRAY(e, MODAL_MASS), modal, product);
    flexbody_add(1, product, y);
#else
    flexbody_add(1, modal, y);
#endif
}

/* ---- the state ---- */

/* What depends on q alone. */
static inline void flexbody_deform(flexbody_evaluation *e)
{
    const flexbody_real *rigid = FLEXBODY_ARRAY(e, RIGID), *linear = FLEXBODY_ARRAY(e, LINEAR);
    flexbody_real of_q[FLEXBODY_STRIDE_LINEAR], moment[3] = {0, 0, 0};
    flexbody_product(FLEXBODY_STRIDE_LINEAR, linear, e->q, of_q);
    for (size_t i = 0; i < 3; ++i)
        e->first_moment[i] = 0;
    for (size_t i = 0; i < 9; ++i)
        e->inertia[i] = e->lever[i] = 0;
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k) {
        moment[k] = rigid[1 + k];
        e->first_moment[k] = moment[k] + of_q[FLEXBODY_ROW_C1 + k];
        for (size_t a = 0; a < FLEXBODY_AXES; ++a)
            e->lever[3 * k + flexbody_axis[a]] = of_q[k * FLEXBODY_AXES + a];
    }
    flexbody_add_skew(-1, moment, e->lever);
    for (size_t pair = 0; pair < FLEXBODY_PAIRS; ++pair) {
        flexbody_real value = rigid[1 + FLEXBODY_TRANSLATIONS + pair];
#if FLEXBODY_HAS_W1
        value += of_q[FLEXBODY_ROW_W1 + pair];
#endif
        flexbody_add_pair(pair, value, e->inertia);
    }
#if FLEXBODY_HAS_W2
    flexbody_product(FLEXBODY_STRIDE_W2, FLEXBODY_ARRAY(e, W2), e->q, e->w2_q);
    for (size_t pair = 0; pair < FLEXBODY_PAIRS; ++pair)
        flexbody_add_pair(pair, flexbody_dot(FLEXBODY_MODES, e->q, e->w2_q + pair * FLEXBODY_MODES), e->inertia);
#endif
    /* C1 and C2 are rows one below the other. */
    for (size_t j = 0; j < FLEXBODY_MODES; ++j)
        for (size_t k = 0; k < FLEXBODY_RIGID; ++k)
            e->coupling[k][j] = linear[j * FLEXBODY_STRIDE_LINEAR + FLEXBODY_ROW_C1 + k];
#if FLEXBODY_HAS_ACCELERATION
    flexbody_real shift[3] = {0, 0, 0};
    flexbody_product(FLEXBODY_STRIDE_ACCELERATION, FLEXBODY_ARRAY(e, ACCELERATION), e->q, e->acceleration_q);
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k) {
        const flexbody_real *product = e->acceleration_q + k * FLEXBODY_MODES;
        flexbody_add(1, product, e->coupling[k]);
        shift[k] = (flexbody_real)0.5 * flexbody_dot(FLEXBODY_MODES, e->q, product);
        e->first_moment[k] += shift[k];
    }
    flexbody_add_skew(-1, shift, e->lever);
#endif
#if FLEXBODY_HAS_W3
    flexbody_product(FLEXBODY_STRIDE_W3, FLEXBODY_ARRAY(e, W3), e->q, e->w3_q);
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        flexbody_add(1, e->w3_q + a * FLEXBODY_MODES, e->coupling[FLEXBODY_TRANSLATIONS + a]);
#endif
}

/* What depends on the velocities: momenta, and h = dMc/dt nu + (omega x p, omega x h + V x p, -dT/dq). */
static inline void flexbody_move(flexbody_evaluation *e)
{
    const flexbody_real *rigid = FLEXBODY_ARRAY(e, RIGID), *linear = FLEXBODY_ARRAY(e, LINEAR);
    const flexbody_real *v = e->velocity, *w = e->omega;
    flexbody_real *modal = e->velocity_forces + FLEXBODY_RIGID;
    flexbody_real of_qd[FLEXBODY_STRIDE_LINEAR], weight[FLEXBODY_STRIDE_LINEAR];
    flexbody_real lever_rate[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0}, inertia_rate[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    flexbody_real c1_qd[3] = {0, 0, 0}, force[3] = {0, 0, 0}, torque[3] = {0, 0, 0};
    flexbody_product(FLEXBODY_STRIDE_LINEAR, linear, e->qd, of_qd);
    for (size_t row = 0; row < FLEXBODY_STRIDE_LINEAR; ++row)
        weight[row] = 0;
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k) {
        c1_qd[k] = of_qd[FLEXBODY_ROW_C1 + k];
        for (size_t a = 0; a < FLEXBODY_AXES; ++a) {
            lever_rate[3 * k + flexbody_axis[a]] = of_qd[k * FLEXBODY_AXES + a];
            weight[k * FLEXBODY_AXES + a] = -(v[k] * w[flexbody_axis[a]]);
        }
    }
#if FLEXBODY_HAS_ACCELERATION
    flexbody_real rate[3] = {0, 0, 0}, carried[3] = {0, 0, 0};
    flexbody_product(FLEXBODY_STRIDE_ACCELERATION, FLEXBODY_ARRAY(e, ACCELERATION), e->qd, e->acceleration_qd);
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k) {
        rate[k] = flexbody_dot(FLEXBODY_MODES, e->acceleration_q + k * FLEXBODY_MODES, e->qd);
        c1_qd[k] += rate[k];
        force[k] += flexbody_dot(FLEXBODY_MODES, e->acceleration_qd + k * FLEXBODY_MODES, e->qd);
    }
    flexbody_add_skew(-1, rate, lever_rate);
    flexbody_add_cross(w, v, carried);
#endif
#if FLEXBODY_HAS_W1 || FLEXBODY_HAS_W2
    flexbody_real spin[FLEXBODY_PAIRS]; /* w_a w_b, summed over both orders of different axes */
    for (size_t pair = 0; pair < FLEXBODY_PAIRS; ++pair) {
        const size_t a = flexbody_pair[pair][0], b = flexbody_pair[pair][1];
        spin[pair] = a == b ? w[a] * w[b] : 2 * w[a] * w[b];
    }
#endif
#if FLEXBODY_HAS_W1
    for (size_t pair = 0; pair < FLEXBODY_PAIRS; ++pair) {
        flexbody_add_pair(pair, of_qd[FLEXBODY_ROW_W1 + pair], inertia_rate);
        weight[FLEXBODY_ROW_W1 + pair] = (flexbody_real)-0.5 * spin[pair];
    }
#endif
    for (size_t j = 0; j < FLEXBODY_MODES; ++j)
        modal[j] = flexbody_dot(FLEXBODY_ROW_C1, weight, linear + j * FLEXBODY_STRIDE_LINEAR);
#if FLEXBODY_HAS_ACCELERATION
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        flexbody_add(carried[k], e->acceleration_q + k * FLEXBODY_MODES, modal);
#endif
#if FLEXBODY_HAS_W2
    for (size_t pair = 0; pair < FLEXBODY_PAIRS; ++pair) {
        const flexbody_real *product = e->w2_q + pair * FLEXBODY_MODES;
        flexbody_add_pair(pair, 2 * flexbody_dot(FLEXBODY_MODES, e->qd, product), inertia_rate);
        flexbody_add(-spin[pair], product, modal);
    }
#endif
#if FLEXBODY_HAS_W3
    flexbody_product(FLEXBODY_STRIDE_W3, FLEXBODY_ARRAY(e, W3), e->qd, e->w3_qd);
#if FLEXBODY_HAS_W3_SKEW
    flexbody_product(FLEXBODY_STRIDE_W3_SKEW, FLEXBODY_ARRAY(e, W3_SKEW), e->qd, e->skew_qd);
#endif
    for (size_t a = 0; a < FLEXBODY_AXES; ++a) {
        const size_t axis = flexbody_axis[a];
#if FLEXBODY_HAS_W3_SKEW
        torque[axis] += flexbody_dot(FLEXBODY_MODES, e->w3_qd + a * FLEXBODY_MODES, e->qd);
        flexbody_add(w[axis], e->skew_qd + a * FLEXBODY_MODES, modal);
#else
        /* W3 is skew: qd'W3 qd = 0. */
        flexbody_add(2 * w[axis], e->w3_qd + a * FLEXBODY_MODES, modal);
#endif
    }
#endif
    flexbody_real *p = e->linear_momentum, *h = e->angular_momentum;
    for (size_t k = 0; k < 3; ++k) {
        p[k] = rigid[0] * v[k] + c1_qd[k];
        h[k] = 0;
    }
    flexbody_add_product3(e->lever, w, p);
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        h[flexbody_axis[a]] = flexbody_dot(FLEXBODY_MODES, e->coupling[FLEXBODY_TRANSLATIONS + a], e->qd);
    flexbody_add_transposed3(e->lever, v, h);
    flexbody_add_product3(e->inertia, w, h);

    flexbody_add_product3(lever_rate, w, force);
    flexbody_add_cross(w, p, force);
    flexbody_add_transposed3(lever_rate, v, torque);
    flexbody_add_product3(inertia_rate, w, torque);
    flexbody_add_cross(w, h, torque);
    flexbody_add_cross(v, p, torque);
    for (size_t i = 0; i < FLEXBODY_RIGID; ++i)
        e->velocity_forces[i] = 0;
    flexbody_add_rigid(force, torque, e->velocity_forces);
}

/* Goes to the state with modal coordinates q (FLEXBODY_MODES) and velocities nu (FLEXBODY_VELOCITIES). */
static inline void flexbody_set(flexbody_evaluation *e, const flexbody_real *q, const flexbody_real *nu)
{
    flexbody_split(nu, e->velocity, e->omega);
    for (size_t j = 0; j < FLEXBODY_MODES; ++j) {
        e->q[j] = q[j];
        e->qd[j] = nu[FLEXBODY_RIGID + j];
    }
    flexbody_deform(e);
    flexbody_move(e);
}

/* ---- accelerations and forces ---- */

#if FLEXBODY_HAS_MODAL_MASS
/* x <- L^-1 x and x <- L^-T x of m_ff = L L'. */
static inline void flexbody_solve_lower(const flexbody_real *factor, flexbody_real *x)
{
    for (size_t i = 0; i < FLEXBODY_MODES; ++i) {
        const flexbody_real *row = factor + i * FLEXBODY_STRIDE_MODAL_MASS_FACTOR;
        x[i] = (x[i] - flexbody_dot(i, row, x)) / row[i];
    }
}

static inline void flexbody_solve_upper(const flexbody_real *factor, flexbody_real *x)
{
    for (size_t i = FLEXBODY_MODES; i-- > 0;) {
        const flexbody_real *row = factor + i * FLEXBODY_STRIDE_MODAL_MASS_FACTOR;
        x[i] /= row[i];
        for (size_t j = 0; j < i; ++j)
            x[j] -= row[j] * x[i];
    }
}
#endif

/* Solves A x = x, A symmetric, given below its diagonal; fails if A is not positive definite. A = L D L' takes no roots. */
static inline int flexbody_solve_rigid(flexbody_real a[FLEXBODY_RIGID][FLEXBODY_RIGID], flexbody_real x[FLEXBODY_RIGID])
{
    for (size_t i = 0; i < FLEXBODY_RIGID; ++i) {
        for (size_t j = 0; j < i; ++j) {
            /* a_ij holds l_ij d_j until the row is done. */
            for (size_t k = 0; k < j; ++k)
                a[i][j] -= a[i][k] * a[j][k];
        }
        for (size_t j = 0; j < i; ++j) {
            const flexbody_real scaled = a[i][j];
            a[i][j] /= a[j][j];
            a[i][i] -= scaled * a[i][j];
            x[i] -= a[i][j] * x[j];
        }
        /* Also false for what is no number. */
        if (!(a[i][i] > 0))
            return FLEXBODY_NOT_POSITIVE_DEFINITE;
    }
    for (size_t i = FLEXBODY_RIGID; i-- > 0;) {
        x[i] /= a[i][i];
        for (size_t k = i + 1; k < FLEXBODY_RIGID; ++k)
            x[i] -= a[k][i] * x[k];
    }
    return FLEXBODY_OK;
}

/*
 * nu' from the applied forces other than elastic and damping forces (both FLEXBODY_VELOCITIES), by elimination of the modes. After a
 * failure `acceleration` is without meaning.
 */
static inline int flexbody_accelerations(flexbody_evaluation *e, const flexbody_real *applied, flexbody_real *acceleration)
{
    flexbody_real matrix[FLEXBODY_RIGID][FLEXBODY_RIGID], x[FLEXBODY_RIGID];
    flexbody_real *modal = e->modal;
    for (size_t j = 0; j < FLEXBODY_MODES; ++j)
        modal[j] = applied[FLEXBODY_RIGID + j] - e->velocity_forces[FLEXBODY_RIGID + j];
    flexbody_add_stiffness(e, -1, modal);
    flexbody_add_damping(e, -1, modal);
#if FLEXBODY_HAS_MODAL_MASS
    const flexbody_real *factor = FLEXBODY_ARRAY(e, MODAL_MASS_FACTOR);
    flexbody_solve_lower(factor, modal);
    for (size_t i = 0; i < FLEXBODY_RIGID; ++i) {
        for (size_t j = 0; j < FLEXBODY_MODES; ++j)
            e->whitened[i][j] = e->coupling[i][j];
        flexbody_solve_lower(factor, e->whitened[i]);
    }
    flexbody_real(*rows)[FLEXBODY_MODES] = e->whitened;
#else
    flexbody_real(*rows)[FLEXBODY_MODES] = e->coupling;
#endif
    for (size_t i = 0; i < FLEXBODY_RIGID; ++i) {
        x[i] = applied[i] - e->velocity_forces[i] - flexbody_dot(FLEXBODY_MODES, rows[i], modal);
        for (size_t j = 0; j <= i; ++j) {
            flexbody_real mass;
            if (i < FLEXBODY_TRANSLATIONS)
                mass = i == j ? FLEXBODY_ARRAY(e, RIGID)[0] : 0;
            else if (j < FLEXBODY_TRANSLATIONS)
                mass = e->lever[3 * j + flexbody_axis[i - FLEXBODY_TRANSLATIONS]];
            else
                mass = e->inertia[3 * flexbody_axis[i - FLEXBODY_TRANSLATIONS] + flexbody_axis[j - FLEXBODY_TRANSLATIONS]];
            matrix[i][j] = mass - flexbody_dot(FLEXBODY_MODES, rows[i], rows[j]);
        }
    }
    if (flexbody_solve_rigid(matrix, x) != FLEXBODY_OK)
        return FLEXBODY_NOT_POSITIVE_DEFINITE;
    for (size_t i = 0; i < FLEXBODY_RIGID; ++i) {
        acceleration[i] = x[i];
        flexbody_add(-x[i], rows[i], modal);
    }
#if FLEXBODY_HAS_MODAL_MASS
    flexbody_solve_upper(factor, modal);
#endif
    for (size_t j = 0; j < FLEXBODY_MODES; ++j)
        acceleration[FLEXBODY_RIGID + j] = modal[j];
    return FLEXBODY_OK;
}

/* The forces that have to be applied for the accelerations nu': Mc(q) nu' + h + (0, 0, K q + D qd). */
static inline void flexbody_balance(const flexbody_evaluation *e, const flexbody_real *acceleration, flexbody_real *forces)
{
    const flexbody_real mass = FLEXBODY_ARRAY(e, RIGID)[0], *modal = acceleration + FLEXBODY_RIGID;
    flexbody_real linear[3], angular[3], force[3] = {0, 0, 0}, torque[3] = {0, 0, 0};
    flexbody_split(acceleration, linear, angular);
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        force[k] = mass * linear[k] + flexbody_dot(FLEXBODY_MODES, e->coupling[k], modal);
    for (size_t a = 0; a < FLEXBODY_AXES; ++a)
        torque[flexbody_axis[a]] = flexbody_dot(FLEXBODY_MODES, e->coupling[FLEXBODY_TRANSLATIONS + a], modal);
    flexbody_add_product3(e->lever, angular, force);
    flexbody_add_transposed3(e->lever, linear, torque);
    flexbody_add_product3(e->inertia, angular, torque);
    for (size_t i = 0; i < FLEXBODY_VELOCITIES; ++i)
        forces[i] = e->velocity_forces[i];
    flexbody_add_rigid(force, torque, forces);
    flexbody_add_modal_inertia(e, linear, angular, modal, forces + FLEXBODY_RIGID);
    flexbody_add_stiffness(e, 1, forces + FLEXBODY_RIGID);
    flexbody_add_damping(e, 1, forces + FLEXBODY_RIGID);
}

/* Adds the forces of uniform gravity, given in body axes: (m g, s x g, C1(q)'g). */
static inline void flexbody_add_gravity(const flexbody_evaluation *e, const flexbody_real gravity[3], flexbody_real *forces)
{
    flexbody_real force[3], torque[3] = {0, 0, 0};
    for (size_t k = 0; k < 3; ++k)
        force[k] = FLEXBODY_ARRAY(e, RIGID)[0] * gravity[k];
    flexbody_add_cross(e->first_moment, gravity, torque);
    flexbody_add_rigid(force, torque, forces);
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k)
        flexbody_add(gravity[k], e->coupling[k], forces + FLEXBODY_RIGID);
}

/* ---- momenta and energies ---- */

/* (p, h, pi) = Mc(q) nu, in the order of nu; the components of p and h that a plane body does not have are in e. */
static inline void flexbody_momenta(const flexbody_evaluation *e, flexbody_real *momenta)
{
    for (size_t i = 0; i < FLEXBODY_VELOCITIES; ++i)
        momenta[i] = 0;
    flexbody_add_rigid(e->linear_momentum, e->angular_momentum, momenta);
    flexbody_add_modal_inertia(e, e->velocity, e->omega, e->qd, momenta + FLEXBODY_RIGID);
}

/* nu'Mc(q) nu / 2. */
static inline flexbody_real flexbody_kinetic_energy(const flexbody_evaluation *e)
{
    flexbody_real momenta[FLEXBODY_VELOCITIES];
    flexbody_momenta(e, momenta);
    return (flexbody_real)0.5
           * (flexbody_dot3(e->velocity, e->linear_momentum) + flexbody_dot3(e->omega, e->angular_momentum)
              + flexbody_dot(FLEXBODY_MODES, momenta + FLEXBODY_RIGID, e->qd));
}

/* q'K q / 2. */
static inline flexbody_real flexbody_elastic_energy(const flexbody_evaluation *e)
{
    flexbody_real product[FLEXBODY_MODES];
    for (size_t j = 0; j < FLEXBODY_MODES; ++j)
        product[j] = 0;
    flexbody_add_stiffness(e, 1, product);
    return (flexbody_real)0.5 * flexbody_dot(FLEXBODY_MODES, e->q, product);
}

#if FLEXBODY_FRAMES > 0
/* ---- frames: places where forces and torques act and motion is read ---- */

/* Index of the frame of the node or reference point with this number; FLEXBODY_FRAMES if there is none. */
static inline size_t flexbody_frame(const flexbody_evaluation *e, int64_t number)
{
    const int64_t *numbers = (const int64_t *)(const void *)(e->data + FLEXBODY_OFFSET_FRAME_NUMBER);
    size_t i = 0;
    while (i < FLEXBODY_FRAMES && numbers[i] != number)
        ++i;
    return i;
}

/* Rows of the modes at a frame: its displacement, or its rotation vector. */
typedef struct {
    const flexbody_real *rows;
    const unsigned char *axes;
    size_t count;
    const flexbody_real *second[3]; /* K of motion of second order along each axis, or null */
} flexbody_motion;

static const unsigned char flexbody_translation_axis[3] = {0, 1, 2};

static inline int flexbody_motion_of(const flexbody_evaluation *e, size_t frame, int turning, flexbody_motion *motion)
{
    if (frame >= FLEXBODY_FRAMES)
        return FLEXBODY_NO_FRAME;
    const int32_t *parts = FLEXBODY_PARTS(e) + 3 * frame;
    motion->rows = FLEXBODY_ARRAY(e, FRAME_TRANSLATION) + frame * FLEXBODY_TRANSLATIONS * FLEXBODY_MODES;
    motion->axes = flexbody_translation_axis;
    motion->count = FLEXBODY_TRANSLATIONS;
    if (turning && parts[0] < 0)
        return FLEXBODY_NO_ORIENTATION;
#if FLEXBODY_ROTATIONS > 0
    if (turning) {
        motion->rows = FLEXBODY_ARRAY(e, FRAME_ROTATION) + (size_t)parts[0] * FLEXBODY_AXES * FLEXBODY_MODES;
        motion->axes = flexbody_axis;
        motion->count = FLEXBODY_AXES;
    }
#endif
    motion->second[0] = motion->second[1] = motion->second[2] = NULL;
#if FLEXBODY_SECONDS > 0
    const flexbody_real *next = FLEXBODY_ARRAY(e, FRAME_SECOND) + (size_t)parts[1] * FLEXBODY_MODES * FLEXBODY_MODES;
    for (int bit = 0; bit < 6; ++bit)
        if (parts[2] >> bit & 1) {
            if (bit / 3 == turning)
                motion->second[bit % 3] = next;
            next += FLEXBODY_MODES * FLEXBODY_MODES;
        }
#endif
    return FLEXBODY_OK;
}

/* Psi q - q'K q / 2, and its rate Psi qd - q'K qd. */
static inline void flexbody_follow(const flexbody_evaluation *e, const flexbody_motion *motion, flexbody_real value[3], flexbody_real rate[3])
{
    for (size_t k = 0; k < 3; ++k)
        value[k] = rate[k] = 0;
    for (size_t k = 0; k < motion->count; ++k) {
        value[motion->axes[k]] = flexbody_dot(FLEXBODY_MODES, motion->rows + k * FLEXBODY_MODES, e->q);
        rate[motion->axes[k]] = flexbody_dot(FLEXBODY_MODES, motion->rows + k * FLEXBODY_MODES, e->qd);
    }
#if FLEXBODY_SECONDS > 0
    for (size_t k = 0; k < 3; ++k)
        if (motion->second[k] != NULL) {
            flexbody_real product[FLEXBODY_MODES];
            flexbody_product(FLEXBODY_MODES, motion->second[k], e->q, product);
            value[k] -= (flexbody_real)0.5 * flexbody_dot(FLEXBODY_MODES, product, e->q);
            rate[k] -= flexbody_dot(FLEXBODY_MODES, product, e->qd);
        }
#endif
}

/* modal += (Psi - q'K)'load. */
static inline void flexbody_add_work(const flexbody_evaluation *e, const flexbody_motion *motion, const flexbody_real load[3],
                                     flexbody_real *modal)
{
    for (size_t k = 0; k < motion->count; ++k)
        flexbody_add(load[motion->axes[k]], motion->rows + k * FLEXBODY_MODES, modal);
#if FLEXBODY_SECONDS > 0
    for (size_t k = 0; k < 3; ++k)
        if (motion->second[k] != NULL) {
            flexbody_real product[FLEXBODY_MODES];
            flexbody_product(FLEXBODY_MODES, motion->second[k], e->q, product);
            flexbody_add(-load[k], product, modal);
        }
#else
    (void)e;
#endif
}

/*
 * sin f / f, (1 - cos f) / f^2 and (f - sin f) / f^3 of the rotation vector's length f: their power series below f = 1, from there twice the
 * half angle as often as it takes.
 */
static inline void flexbody_coefficients(const flexbody_real v[3], flexbody_real c[3])
{
    flexbody_real square = flexbody_dot3(v, v);
    int halvings = 0;
    for (; square > 1 && halvings < 64; ++halvings)
        square *= (flexbody_real)0.25;
    for (int n = 0; n < 3; ++n) {
        /* sum_k (-1)^k f^2k / (2k + n + 1)!, from its last term: the next is below 1e-20. */
        flexbody_real sum = 1;
        for (int k = 10; k > 0; --k)
            sum = 1 - sum * square / (flexbody_real)((2 * k + n) * (2 * k + n + 1));
        c[n] = n < 2 ? sum / (flexbody_real)(n + 1) : sum / 6;
    }
    for (; halvings > 0; --halvings, square *= 4) {
        const flexbody_real a = c[0], b = c[1];
        c[0] = a * (1 - square * b);
        c[1] = (flexbody_real)0.5 * a * a;
        c[2] = (flexbody_real)0.25 * (c[2] + a * b);
    }
}

/* y = x + b v x x + c v x (v x x). */
static inline void flexbody_turn(const flexbody_real v[3], flexbody_real b, flexbody_real c, const flexbody_real x[3], flexbody_real y[3])
{
    flexbody_real once[3] = {0, 0, 0}, twice[3] = {0, 0, 0};
    flexbody_add_cross(v, x, once);
    flexbody_add_cross(v, once, twice);
    for (size_t k = 0; k < 3; ++k)
        y[k] = x[k] + b * once[k] + c * twice[k];
}

/* Place r(q) of a frame in the deformed body, and its velocity V + omega x r + dr/dt; body axes. */
static inline int flexbody_frame_motion(const flexbody_evaluation *e, size_t frame, flexbody_real position[3], flexbody_real velocity[3])
{
    flexbody_motion motion;
    const int code = flexbody_motion_of(e, frame, 0, &motion);
    if (code != FLEXBODY_OK)
        return code;
    flexbody_follow(e, &motion, position, velocity);
    for (size_t k = 0; k < FLEXBODY_TRANSLATIONS; ++k) {
        position[k] += FLEXBODY_ARRAY(e, FRAME_POSITION)[frame * FLEXBODY_TRANSLATIONS + k];
        velocity[k] += e->velocity[k];
    }
    flexbody_add_cross(e->omega, position, velocity);
    return FLEXBODY_OK;
}

/* Axes of a frame (row-major, its axes in columns), the identity without deformation, and its angular velocity; body axes. */
static inline int flexbody_frame_rotation(const flexbody_evaluation *e, size_t frame, flexbody_real axes[9], flexbody_real angular_velocity[3])
{
    flexbody_motion motion;
    flexbody_real vector[3], rate[3], c[3];
    const int code = flexbody_motion_of(e, frame, 1, &motion);
    if (code != FLEXBODY_OK)
        return code;
    flexbody_follow(e, &motion, vector, rate);
    flexbody_coefficients(vector, c);
    for (size_t k = 0; k < 3; ++k) {
        flexbody_real unit[3] = {0, 0, 0}, column[3];
        unit[k] = 1;
        flexbody_turn(vector, c[0], c[1], unit, column);
        for (size_t i = 0; i < 3; ++i)
            axes[3 * i + k] = column[i];
    }
    flexbody_turn(vector, c[1], c[2], rate, angular_velocity);
    for (size_t k = 0; k < 3; ++k)
        angular_velocity[k] += e->omega[k];
    return FLEXBODY_OK;
}

/* Adds a force at a frame, in body axes: (b, r x b, (dr/dq)'b). */
static inline int flexbody_add_force(const flexbody_evaluation *e, size_t frame, const flexbody_real force[3], flexbody_real *forces)
{
    flexbody_motion motion;
    flexbody_real position[3], velocity[3], torque[3] = {0, 0, 0};
    const int code = flexbody_motion_of(e, frame, 0, &motion);
    if (code != FLEXBODY_OK)
        return code;
    flexbody_frame_motion(e, frame, position, velocity);
    flexbody_add_cross(position, force, torque);
    flexbody_add_rigid(force, torque, forces);
    flexbody_add_work(e, &motion, force, forces + FLEXBODY_RIGID);
    return FLEXBODY_OK;
}

/* Adds a torque at a frame, in body axes: (0, t, (dtheta/dq)'G(theta) t) with the frame's rotation vector theta. */
static inline int flexbody_add_torque(const flexbody_evaluation *e, size_t frame, const flexbody_real torque[3], flexbody_real *forces)
{
    static const flexbody_real none[3] = {0, 0, 0};
    flexbody_motion motion;
    flexbody_real vector[3], rate[3], c[3], load[3];
    const int code = flexbody_motion_of(e, frame, 1, &motion);
    if (code != FLEXBODY_OK)
        return code;
    flexbody_follow(e, &motion, vector, rate);
    flexbody_coefficients(vector, c);
    flexbody_turn(vector, -c[1], c[2], torque, load);
    flexbody_add_rigid(none, torque, forces);
    flexbody_add_work(e, &motion, load, forces + FLEXBODY_RIGID);
    return FLEXBODY_OK;
}
#endif /* FLEXBODY_FRAMES > 0 */

#endif /* FLEXBODY_H */
