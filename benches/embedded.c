/* embedded FILE STATES SECONDS...: for every word behind STATES, evaluates accelerations at the states in turn that many times, and prints
 * the seconds of processor time of one. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

extern const size_t real_bytes, inputs, velocities_count;
int open_body(const void *data, size_t size);
void accelerate(const void *state, void *acceleration);

static _Alignas(64) unsigned char data[64 << 20];
static _Alignas(64) unsigned char states[1 << 20];

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
    if (count < 3 || open_body(data, contents(words[1], data, sizeof data)) != 0)
        return 101;
    const size_t bytes = inputs * real_bytes, n = contents(words[2], states, sizeof states) / bytes;
    unsigned char *acceleration = malloc(velocities_count * real_bytes);
    if (n == 0 || acceleration == NULL)
        return 102;
    for (int word = 3; word < count; ++word) {
        const long calls = atol(words[word]);
        const clock_t start = clock();
        for (long i = 0; i < calls; ++i)
            accelerate(states + (size_t)i % n * bytes, acceleration);
        printf("%.9e\n", (double)(clock() - start) / CLOCKS_PER_SEC / (double)calls);
    }
    free(acceleration);
    return 0;
}
