package dev.foresound.demo

import android.content.Context
import android.graphics.Canvas
import android.graphics.Color
import android.graphics.Paint
import android.view.View
import dev.foresound.SceneInfo
import dev.foresound.ShownPath

/** The scene from above: its bounds, the sources, the listener, and the loudest paths, brighter the louder. Main thread. */
class PathView(context: Context) : View(context) {
    private val paint = Paint()
    private var low = floatArrayOf(0f, 0f)
    private var high = floatArrayOf(1f, 1f)
    private var paths: List<ShownPath> = emptyList()
    private var sources: List<FloatArray> = emptyList()
    private var listener = floatArrayOf(0f, 0f, 0f)

    fun show(info: SceneInfo, positions: List<FloatArray>) {
        low = floatArrayOf(info.boundsMinM[0].toFloat(), info.boundsMinM[2].toFloat())
        high = floatArrayOf(info.boundsMaxM[0].toFloat(), info.boundsMaxM[2].toFloat())
        sources = positions
        paths = emptyList()
    }

    fun update(found: List<ShownPath>, ear: FloatArray) {
        paths = found
        listener = ear
        invalidate()
    }

    private fun scale() =
        0.95f * minOf(width / maxOf(high[0] - low[0], 0.1f), height / maxOf(high[1] - low[1], 0.1f))

    private fun x(metres: Float) = width / 2f + (metres - (low[0] + high[0]) / 2) * scale()

    private fun y(metres: Float) = height / 2f + (metres - (low[1] + high[1]) / 2) * scale()

    override fun onDraw(canvas: Canvas) {
        canvas.drawColor(Color.BLACK)
        paint.isAntiAlias = true
        paint.strokeWidth = 2f
        paint.style = Paint.Style.STROKE
        paint.color = Color.GRAY
        canvas.drawRect(x(low[0]), y(low[1]), x(high[0]), y(high[1]), paint)
        for (path in paths) {
            val colour = when {
                path.diffractionOrder > 0 -> Color.CYAN
                path.reflections == 0 -> Color.WHITE
                path.reflections == 1 -> Color.GREEN
                else -> Color.YELLOW
            }
            paint.color = colour
            // From 60 dB below the free field at 1 m to its level.
            paint.alpha = (255 * (path.levelDb + 60) / 60).toInt().coerceIn(20, 255)
            val corners = path.corners
            for (from in 0 until corners.size - 3 step 3) {
                canvas.drawLine(
                    x(corners[from]), y(corners[from + 2]), x(corners[from + 3]), y(corners[from + 5]), paint,
                )
            }
        }
        paint.style = Paint.Style.FILL
        paint.color = Color.RED
        for (position in sources) canvas.drawCircle(x(position[0]), y(position[2]), 8f, paint)
        paint.color = Color.WHITE
        canvas.drawCircle(x(listener[0]), y(listener[2]), 10f, paint)
    }
}
