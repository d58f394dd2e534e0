"""Embedded: this module compiles and calls the C99 header of the body, which evaluates the equations of docs/reference/formats/embedded.md from the numbers beside it.

The header takes velocities of the origin along body axes: it is called with a velocity of flight, of which the accelerations may not depend.
"""

import ctypes
import re
import shutil
import subprocess

import numpy as np

from common import Absent

from .equations import Equations, Place

SOURCE = """
#include "body.h"
typedef NAME_real real;
static NAME_evaluation e;
int open_body(const void *data, size_t size) { return NAME_open(&e, data, size); }
void set(const real *q, const real *nu) { NAME_set(&e, q, nu); }
int accelerations(const real *applied, real *out) { return NAME_accelerations(&e, applied, out); }
void balance(const real *rates, real *out) { NAME_balance(&e, rates, out); }
void gravity(const real *g, real *out) { NAME_add_gravity(&e, g, out); }
void force(size_t i, const real *f, real *out) { NAME_add_force(&e, i, f, out); }
void torque(size_t i, const real *t, real *out) { NAME_add_torque(&e, i, t, out); }
void place(size_t i, real *position, real *velocity) { NAME_frame_motion(&e, i, position, velocity); }
int turn(size_t i, real *axes, real *rate) { return NAME_frame_rotation(&e, i, axes, rate); }
"""


class Embedded(Equations):
    finite_moments = True

    def __init__(self, path, general=False):
        compiler = shutil.which("cc") or shutil.which("gcc")
        if not compiler:
            raise Absent("cc (a C compiler)")
        header = path.with_suffix(".h")
        text = header.read_text()
        capital = re.search(r"#define (FLEXBODY_\w+)_LAYOUT \d+", text)[1]
        define = lambda name: int(re.search(rf"#define {capital}_{name} (\d+)", text)[1])
        name = capital.lower()
        assert f"{name}_open" in text
        source, library = path.with_suffix(".c"), path.with_suffix(".so")
        source.write_text(SOURCE.replace('"body.h"', f'"{header.name}"').replace("NAME", name))
        subprocess.run([compiler, "-std=c99", "-O2", "-shared", "-fPIC", source.name, "-o", library.name], cwd=path.parent, check=True, capture_output=True)
        self.library = ctypes.CDLL(str(library))
        self.type = np.float64 if define("PRECISION") == 8 else np.float32
        # A multiple of 64, as the header wants it.
        data = np.fromfile(path, np.uint8)
        room = np.zeros(len(data) + 64, np.uint8)
        start = -room.ctypes.data % 64
        room[start : start + len(data)] = data
        self.data = room
        assert self.library.open_body(ctypes.c_void_p(room.ctypes.data + start), ctypes.c_size_t(len(data))) == 0
        self.modes = define("MODES")
        self.order = "first" if general else "exact"
        self.flight = np.array([3.0, -2.0, 1.0])
        self.set(np.zeros(self.modes), np.zeros(3), np.zeros(self.modes))
        self.places = self.frames(define("FRAMES"), data)

    def frames(self, count, data):
        """Returns the places by the functions of the header, one mode at a time. Numbers come from the table of docs/reference/formats/embedded.md."""
        nf = self.modes
        start = lambda entry: int.from_bytes(bytes(data[entry : entry + 4]), "little")
        at = start(232)
        self.ids = np.frombuffer(bytes(data[at : at + 8 * count]), "<i8")
        positions, shape, rotation = np.zeros((count, 3)), np.zeros((count, 3, nf)), np.zeros((count, 3, nf))
        turning = np.zeros(count, bool)
        still = np.zeros(nf)
        flight, self.flight = self.flight, np.zeros(3)
        for j in range(nf):
            self.set(still, np.zeros(3), np.eye(nf)[j])
            for i in range(count):
                where, moving = self.room(3), self.room(3)
                self.call("place", ctypes.c_size_t(i), where, moving)
                positions[i], shape[i, :, j] = where, moving
                axes, rate = self.room(9), self.room(3)
                # 0 (..._OK) where the frame has an orientation.
                if self.library.turn(ctypes.c_size_t(i), self.pointer(axes), self.pointer(rate)) == 0:
                    turning[i], rotation[i, :, j] = True, rate
        self.flight = flight
        self.positions, self.shape, self.rotation = positions, shape, rotation
        self.number = {}
        places = {}
        for i in range(count):
            places[i] = Place(positions[i], shape[i], rotation[i] if turning[i] else None)
            self.number[id(places[i])] = i
        return places

    def room(self, values):
        return np.array(values, self.type) if np.ndim(values) else np.zeros(values, self.type)

    def pointer(self, array):
        return array.ctypes.data_as(ctypes.c_void_p)

    def call(self, name, *arguments):
        return getattr(self.library, name)(*(self.pointer(one) if isinstance(one, np.ndarray) else one for one in arguments))

    def set(self, q, w, qd):
        self.call("set", self.room(q), self.room(np.concatenate([self.flight, w, qd])))
        self.speed = np.cross(w, self.flight)

    def balance(self, q, w, qd, a, alpha, qdd):
        self.set(q, w, qd)
        out = self.room(6 + self.modes)
        self.call("balance", self.room(np.concatenate([a - self.speed, alpha, qdd])), out)
        return out.astype(float)

    def accelerations(self, q, w, qd, applied):
        self.set(q, w, qd)
        out = self.room(6 + self.modes)
        assert self.call("accelerations", self.room(applied), out) is not None
        out = out.astype(float)
        out[:3] += self.speed
        return out

    def elastic(self, q, qd):
        still = np.zeros(3)
        return self.balance(q, still, qd, still, still, np.zeros(self.modes))[6:]

    def applied(self, name, q, *arguments):
        still = np.zeros(3)
        flight, self.flight = self.flight, still
        self.set(q, still, np.zeros(self.modes))
        self.flight = flight
        out = self.room(6 + self.modes)
        self.call(name, *arguments, out)
        return out.astype(float)

    def gravity(self, q, g):
        return self.applied("gravity", q, self.room(g))

    def force(self, place, q, force):
        return self.applied("force", q, ctypes.c_size_t(self.number[id(place)]), self.room(force))

    def moment(self, place, q, moment):
        if place.rotation is None:
            return None
        return self.applied("torque", q, ctypes.c_size_t(self.number[id(place)]), self.room(moment))
