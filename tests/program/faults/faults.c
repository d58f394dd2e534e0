/* A library to be loaded before the program (LD_PRELOAD): the FAULT_N-th call of the kind FAULT_CALL fails once, with the error
   FAULT_ERROR. At the end the number of calls of the kind is written to the file FAULT_COUNTS. Standard streams never fail. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static long calls;

static int fails(const char *kind)
{
    const char *wanted = getenv("FAULT_CALL"), *number = getenv("FAULT_N"), *error = getenv("FAULT_ERROR");
    if (!wanted || !number || !error || strcmp(wanted, kind) || __sync_add_and_fetch(&calls, 1) != atol(number))
        return 0;
    errno = atoi(error);
    return 1;
}

/* The next function of this name: that of the C library. */
#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int file, const void *bytes, size_t count)
{
    return file > 2 && fails("write") ? -1 : NEXT(write)(file, bytes, count);
}
ssize_t pwrite(int file, const void *bytes, size_t count, off_t at)
{
    return fails("write") ? -1 : NEXT(pwrite)(file, bytes, count, at);
}
ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t at)
{
    return fails("write") ? -1 : NEXT(pwrite64)(file, bytes, count, at);
}
ssize_t writev(int file, const struct iovec *parts, int count)
{
    return file > 2 && fails("write") ? -1 : NEXT(writev)(file, parts, count);
}
int fsync(int file)
{
    return fails("fsync") ? -1 : NEXT(fsync)(file);
}
int fdatasync(int file)
{
    return fails("fsync") ? -1 : NEXT(fdatasync)(file);
}
int rename(const char *from, const char *to)
{
    return fails("rename") ? -1 : NEXT(rename)(from, to);
}
int link(const char *from, const char *to)
{
    return fails("rename") ? -1 : NEXT(link)(from, to);
}
int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags)
{
    return fails("rename") ? -1 : NEXT(linkat)(from_folder, from, to_folder, to, flags);
}
int ftruncate(int file, off_t length)
{
    return fails("truncate") ? -1 : NEXT(ftruncate)(file, length);
}
int ftruncate64(int file, off64_t length)
{
    return fails("truncate") ? -1 : NEXT(ftruncate64)(file, length);
}
int close(int file)
{
    int failed = file > 2 && fails("close");
    int closed = NEXT(close)(file);
    return failed ? -1 : closed;
}

static int opens(int flags)
{
    return (flags & (O_WRONLY | O_RDWR)) && fails("open") ? -1 : 0;
}
int open(const char *path, int flags, ...)
{
    va_list rest;
    va_start(rest, flags);
    mode_t mode = va_arg(rest, mode_t);
    va_end(rest);
    return opens(flags) ? -1 : NEXT(open)(path, flags, mode);
}
int open64(const char *path, int flags, ...)
{
    va_list rest;
    va_start(rest, flags);
    mode_t mode = va_arg(rest, mode_t);
    va_end(rest);
    return opens(flags) ? -1 : NEXT(open64)(path, flags, mode);
}

__attribute__((destructor)) static void count(void)
{
    const char *path = getenv("FAULT_COUNTS");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (file) {
        fprintf(file, "%ld\n", calls);
        fclose(file);
    }
}
