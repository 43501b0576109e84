package android.util;

/** As much of Android's class as library and demo use; nothing is logged. */
public final class Log {
    private Log() {}

    public static int i(String tag, String text) {
        return 0;
    }

    public static int w(String tag, String text, Throwable thrown) {
        return 0;
    }
}
