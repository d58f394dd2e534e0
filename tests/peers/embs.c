/* Reads a SID_FEM file with the reader of EMBSlib and prints all that its Modelica model asks for, as doubles of this machine: mass, then M0 and
   M1 of every array of the body, then of every frame. `embs.c FILE FRAMES MODES`. Exits with 2 when the reader complains. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int complaints = 0;

void ModelicaFormatMessage(const char *format, ...)
{
    /* Two of its messages are no complaints. */
    if (strncmp(format, "Allocated", 9) != 0 && strncmp(format, "Read SID", 8) != 0) {
        fprintf(stderr, "%s\n", format);
        complaints++;
    }
}

int matrix2Index(int, int, int, int);
int matrix3Index(int, int, int, int, int, int);

#include "ReadSID_C.h"

static void put(const double *values, size_t count)
{
    if (fwrite(values, sizeof(double), count, stdout) != count)
        exit(3);
}

int main(int count, char **words)
{
    if (count != 4)
        return 1;
    size_t frames = strtoul(words[2], NULL, 10), nq = strtoul(words[3], NULL, 10);
    void *sid = SIDFileConstructor_C(words[1]);
    double mass = getMass(sid);
    put(&mass, 1);
    const struct { const char *name; size_t rows, columns; int linear; } arrays[] = {
        {"mdCM", 3, 1, 1}, {"J", 6, 1, 1}, {"Ct", nq, 3, 1}, {"Cr", nq, 3, 1}, {"Me", nq, nq, 0}, {"Gr", 3, 3 * nq, 0},
        {"Ge", nq, 3 * nq, 0}, {"Oe", nq, 6, 1}, {"ksigma", nq, 1, 0}, {"Ke", nq, nq, 0}, {"De", nq, nq, 0},
    };
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        size_t m0 = arrays[i].rows * arrays[i].columns;
        /* Numbers that no array has: what the reader leaves alone is seen. */
        double *values = malloc((m0 * (nq + 1)) * sizeof(double));
        for (size_t j = 0; j < m0 * (nq + 1); j++)
            values[j] = 12345.0;
        getM0(sid, arrays[i].name, values, arrays[i].rows, arrays[i].columns);
        put(values, m0);
        if (arrays[i].linear) {
            getM1(sid, arrays[i].name, values, arrays[i].rows, nq, arrays[i].columns);
            put(values, m0 * nq);
        }
        free(values);
    }
    const struct { const char *name; size_t columns; } of_frames[] = {{"origin", 1}, {"phi", nq}, {"psi", nq}, {"AP", 3}};
    for (size_t frame = 1; frame <= frames; frame++) {
        for (size_t i = 0; i < 4; i++) {
            size_t m0 = 3 * of_frames[i].columns;
            double *values = calloc(m0 * nq, sizeof(double));
            getM0Node(sid, of_frames[i].name, (int)frame, values, 3, of_frames[i].columns);
            put(values, m0);
            getM1Node(sid, of_frames[i].name, (int)frame, values, 3, nq, of_frames[i].columns);
            put(values, m0 * nq);
            free(values);
        }
    }
    return complaints ? 2 : 0;
}
