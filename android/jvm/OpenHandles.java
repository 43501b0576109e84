package dev.foresound;

/** For tests outside the package. */
public final class OpenHandles {
    private OpenHandles() {}

    /** Handles that are open. */
    public static int count() {
        return Native.openHandles();
    }
}
