/* driver FILE START [STATES]: opens the file, put START bytes behind a multiple of 64, and writes the results at all states to stdout. The
 * exit code is that of the opening. */
#include <stdio.h>
#include <stdlib.h>

extern const size_t real_bytes, inputs, outputs;
int open_body(const void *data, size_t size);
void evaluate(const void *in, void *out);

static _Alignas(64) unsigned char data[64 << 20];

static size_t contents(const char *path, unsigned char *to, size_t room)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        exit(100);
    const size_t size = fread(to, 1, room, file);
    fclose(file);
    return size;
}

int main(int count, char **words)
{
    if (count < 3)
        return 101;
    const size_t start = (size_t)atoi(words[2]);
    const int code = open_body(data + start, contents(words[1], data + start, sizeof data - start));
    if (code == 0 && count > 3) {
        unsigned char *in = malloc(inputs * real_bytes), *out = malloc(outputs * real_bytes);
        FILE *states = fopen(words[3], "rb");
        if (states == NULL || in == NULL || out == NULL)
            return 102;
        while (fread(in, real_bytes, inputs, states) == inputs) {
            evaluate(in, out);
            fwrite(out, real_bytes, outputs, stdout);
        }
        fclose(states);
        free(in);
        free(out);
    }
    return code;
}
