/* Everything that the header of a body offers, at one state, behind two functions. Compiled without a C library. */
#include BODY_HEADER

#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define OF(name) JOIN(SMALL, name) /* flexbody_BODY_name */
#define CONSTANT(name) JOIN(CAPITAL, name)

enum { modes = CONSTANT(MODES), velocities = CONSTANT(VELOCITIES), frames = CONSTANT(FRAMES) };

typedef OF(real) real;

#ifdef __cplusplus
extern "C" {
extern const size_t real_bytes, velocities_count, inputs, outputs;
#endif

const size_t real_bytes = sizeof(real);
const size_t velocities_count = velocities;
const size_t inputs = modes + 2 * velocities + 9;
const size_t outputs = 1 + 4 * velocities + 2 + frames * (3 + 3 + 1 + 9 + 3 + velocities);

static OF(evaluation) e;

int open_body(const void *data, size_t size)
{
    return OF(open)(&e, data, size);
}

/* Accelerations at a state, as below, alone: what is timed. */
void accelerate(const void *state, void *acceleration)
{
    const real *in = (const real *)state;
    OF(set)(&e, in, in + modes);
    OF(accelerations)(&e, in + modes + velocities, (real *)acceleration);
}

/* q, nu, applied forces, gravity, force, torque -> all results, one behind the other. */
void evaluate(const void *state, void *results)
{
    const real *in = (const real *)state;
    real *out = (real *)results;
    const real *applied = in + modes + velocities, *gravity = applied + velocities;
    OF(set)(&e, in, in + modes);
    out[0] = (real)OF(accelerations)(&e, applied, out + 1);
    out += 1 + velocities;
    OF(balance)(&e, applied, out);
    out += velocities;
    OF(momenta)(&e, out);
    out += velocities;
    for (int i = 0; i < velocities; ++i)
        out[i] = 0;
    OF(add_gravity)(&e, gravity, out);
    out += velocities;
    *out++ = OF(kinetic_energy)(&e);
    *out++ = OF(elastic_energy)(&e);
#if CONSTANT(FRAMES) > 0
    for (size_t i = 0; i < frames; ++i) {
        OF(frame_motion)(&e, i, out, out + 3);
        for (int k = 0; k < 12; ++k)
            out[7 + k] = 0;
        out[6] = (real)OF(frame_rotation)(&e, i, out + 7, out + 16);
        out += 19;
        for (int k = 0; k < velocities; ++k)
            out[k] = 0;
        OF(add_force)(&e, i, gravity + 3, out);
        OF(add_torque)(&e, i, gravity + 6, out);
        out += velocities;
    }
#endif
}

#ifdef __cplusplus
}
#endif
