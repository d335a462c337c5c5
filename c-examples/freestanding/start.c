/* The entry of a Linux process without a C library: aligns the stack, calls freestanding_main, exits with its answer. */

#if defined(__x86_64__)
__asm__(".globl _start\n"
        "_start:\n"
        "    xor %ebp, %ebp\n"
        "    and $-16, %rsp\n"
        "    call freestanding_main\n"
        "    mov %eax, %edi\n"
        "    mov $60, %eax\n"
        "    syscall\n");
#elif defined(__aarch64__)
__asm__(".globl _start\n"
        "_start:\n"
        "    mov x29, #0\n"
        "    mov x30, #0\n"
        "    bl freestanding_main\n"
        "    mov x8, #93\n"
        "    svc #0\n");
#else
#error "no entry for this processor"
#endif

/* ISO C forbids a file without a declaration. */
typedef int start_is_assembly;
