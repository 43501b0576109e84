package android.graphics;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Color {
    public static final int BLACK = 0xFF000000;
    public static final int GRAY = 0xFF888888;
    public static final int WHITE = 0xFFFFFFFF;
    public static final int RED = 0xFFFF0000;
    public static final int GREEN = 0xFF00FF00;
    public static final int YELLOW = 0xFFFFFF00;
    public static final int CYAN = 0xFF00FFFF;
}
